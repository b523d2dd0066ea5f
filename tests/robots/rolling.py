"""How well wheels that roll, or skid, fit their simulations, for docs/robots.md.

`python -m tests.robots.rolling` prints both tables.
"""

from __future__ import annotations

from math import hypot, pi

from rems_net.agents.robot import Driver, join
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.robots.differential import Differential
from rems_net.robots.moose import Moose
from rems_net.robots.skid_steered import SkidSteered, skidding
from tests.robots.test_differential import ROBOTS

ENGINES: dict[str, type[Driver]] = {"MuJoCo": Mujoco, "PyBullet": Pybullet}
STEP = 0.02
#: until it goes as fast as it was told, s; a Moose weighs as much as a car
START: dict[type[Differential], float] = {Moose: 6.0}


def rates(
    kind: type[Differential],
    engine: type[Driver],
    left: float,
    right: float,
    heading: float = 0.0,
    seconds: float = 1.0,
) -> tuple[float, float]:
    """Return path, m, and turn, rad, in so many seconds at these wheel speeds, rad/s.

    heading: at the beginning of them, more or less: a start turns a robot a little
    """
    robot = join(kind, engine)("r", initial={"heading": heading})
    robot.prepare()
    robot.open()
    try:
        start = START.get(kind, 0.5)
        robot.command = {"wheel/left": left, "wheel/right": right}
        robot.drive(robot.command, start)
        robot.sense()
        begin, path = float(robot.state["heading"]), 0.0
        for _ in range(round(seconds / STEP)):
            before = robot.state["x"], robot.state["y"]
            robot.drive(robot.command, STEP)
            robot.sense()
            path += hypot(robot.state["x"] - before[0], robot.state["y"] - before[1])
        return path, float(robot.state["heading"]) - begin
    finally:
        robot.close()


def main() -> None:
    """Print the table: how much more than its mathematics each engine does."""
    print("| robot | engine | of full speed | straight | spin | arc, turned |")
    print("|---|---|---|---|---|---|")
    for kind in ROBOTS:
        p = kind("r").parameters
        track = p.effective_track if issubclass(kind, SkidSteered) else p.track
        for name, engine in ENGINES.items():
            for share in (0.15, 0.5):
                top = share * p.max_wheel_speed
                v = p.wheel_radius * top
                straight = rates(kind, engine, top, top)[0] / v
                spin = rates(kind, engine, -top, top)[1] / (2 * v / track)
                turn = rates(kind, engine, 0.5 * top, top)[1] / (0.5 * v / track)
                shown = " | ".join(
                    f"{100 * (cell - 1) + 0.0:+.1f} %"
                    for cell in (straight, spin, turn)
                )
                print(f"| {kind.__name__} | {name} | {share:.0%} | {shown} |")
    print("\n| robot | engine | heading | effective track | spinning | in an arc |")
    print("|---|---|---|---|---|---|")
    for kind in ROBOTS:
        if not issubclass(kind, SkidSteered):
            continue
        p, by_friction = kind("r").parameters, skidding(kind("r").touching())
        top = 0.1 * p.max_wheel_speed
        for name, engine in ENGINES.items():
            for heading in (0.0, pi / 4):
                found = [
                    p.wheel_radius
                    * (top - left)
                    * 0.2
                    / rates(kind, engine, left, top, heading, 0.2)[1]
                    for left in (-top, 0.6 * top)
                ]
                shown = " | ".join(f"{track:.3f} m" for track in (by_friction, *found))
                print(f"| {kind.__name__} | {name} | {heading:.2f} | {shown} |")


if __name__ == "__main__":
    main()

"""How well wheels that roll, or skid, fit their simulations: the tables of
docs/robots.md, printed by `python -m tests.robots.rolling`.
"""

from __future__ import annotations

from math import pi

from rems_net.agents.robot import Driver, join
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.robots.differential import Differential
from rems_net.robots.skid_steered import SkidSteered, skidding
from tests.robots.test_differential import ROBOTS

ENGINES: dict[str, type[Driver]] = {"MuJoCo": Mujoco, "PyBullet": Pybullet}
STEP = 0.02


def rates(
    kind: type[Differential],
    engine: type[Driver],
    left: float,
    right: float,
    heading: float = 0.0,
    seconds: float = 1.0,
) -> tuple[float, float]:
    """Return path, m, and turn, rad, of so many seconds at these wheel speeds, rad/s.

    They begin half a second after it was told.
    """
    robot = join(kind, engine)("r", initial={"heading": heading})
    robot.prepare()
    robot.open()
    try:
        robot.command = {"wheel/left": left, "wheel/right": right}
        path, before = 0.0, (0.0, 0.0, heading)
        for step in range(round((seconds + 0.5) / STEP)):
            robot.drive(robot.command, STEP)
            robot.sense()
            if step == round(0.5 / STEP) - 1:
                path, start = 0.0, float(robot.state["heading"])
                before = robot.state["x"], robot.state["y"], start
            x, y = robot.state["x"], robot.state["y"]
            path += ((x - before[0]) ** 2 + (y - before[1]) ** 2) ** 0.5
            before = x, y, before[2]
        return path, float(robot.state["heading"]) - before[2]
    finally:
        robot.close()


def effective(kind: type[Differential], engine: type[Driver], turn: float) -> float:
    """Return the effective track of a robot that spins at a speed of its wheels."""
    radius: float = kind("r").parameters.wheel_radius
    return 2 * radius * turn / rates(kind, engine, -turn, turn)[1]


def main() -> None:
    """Print both tables."""
    print("| robot | engine | speed | straight | spin | arc, path | arc, turn |")
    print("|---|---|---|---|---|---|---|")
    for kind in ROBOTS:
        p = kind("r").parameters
        track = p.effective_track if issubclass(kind, SkidSteered) else p.track
        for name, engine in ENGINES.items():
            for share in (0.15, 0.5):
                top = share * p.max_wheel_speed
                v = p.wheel_radius * top
                straight = rates(kind, engine, top, top)[0] / v
                spin = rates(kind, engine, -top, top)[1] / (2 * v / track)
                path, turn = rates(kind, engine, 0.5 * top, top)
                cells = straight, spin, path / (0.75 * v), turn / (0.5 * v / track)
                shown = " | ".join(f"{100 * (c - 1):+.1f} %" for c in cells)
                print(f"| {kind.__name__} | {name} | {share:.0%} | {shown} |")
    print("\n| robot | tyres | engine | spinning | in an arc | at a heading of 45 |")
    print("|---|---|---|---|---|---|")
    for kind in (k for k in ROBOTS if issubclass(k, SkidSteered)):
        robot = kind("r")
        p, by_friction = robot.parameters, skidding(robot.touching())
        for name, engine in ENGINES.items():
            top = 0.15 * p.max_wheel_speed
            found = [effective(kind, engine, top)]
            for heading in (0.0, pi / 4):
                turned = rates(kind, engine, 0.8 * top, top, heading, 0.5)[1]
                found.append(p.wheel_radius * 0.2 * top * 0.5 / turned)
            shown = " | ".join(f"{track:.3f} m" for track in found)
            print(f"| {kind.__name__} | {by_friction:.3f} m | {name} | {shown} |")


if __name__ == "__main__":
    main()

"""How well wheels fit their simulations, for docs/measured/accuracy.md.

`python -m tests.robots.rolling` prints the tables.
"""

from dataclasses import replace
from math import hypot, pi

from rems_net.agents.robot import Driver, combine
from rems_net.bodies.body import GRAVITY, lump
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.robots.differential import Differential
from rems_net.robots.moose import Moose
from rems_net.robots.skid_steered import SkidSteered
from tests.robots.skidding import skidding, touching
from tests.robots.test_differential import ROBOTS

ENGINES: dict[str, type[Driver]] = {"MuJoCo": Mujoco, "PyBullet": Pybullet}
STEP = 0.02
#: how much inertia of its gears, kg m2, a Moose is tried with
GEARS = (20.0, 60.0, 120.0, 180.0)


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
    robot = combine(kind, engine)("r", initial={"heading": heading})
    robot.prepare()
    robot.open()
    try:
        # Until it goes as fast as it was told; a Moose weighs as much as a car.
        start = 6.0 if issubclass(kind, Moose) else 0.5
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


def behind(kind: type[SkidSteered], eases: float, h: float = 1e-4) -> float:
    """Return how far a spin in slow motion lags its mathematics, as a share of it.

    By Coulomb's law and inertia alone: its wheels turn as they are told, and those
    that touch bear the same load, whatever it does.
    eases: s to come to a tenth of full speed in
    """
    robot = kind("r")
    robot.prepare()
    body, p = robot.body(), robot.parameters
    links = [
        replace(part, at=(joint.at[0], joint.at[1], 0.0))
        for joint in body.joints
        for part in joint.parts
    ]
    inertia = lump([*body.parts, *links]).inertia[2, 2]
    touch = touching(robot)
    load = p.wheel_friction * p.mass * -GRAVITY / (2 * len(touch))
    turning = heading = told = worst = 0.0
    for n in range(round(4 * eases / h)):
        t = (n + 0.5) * h
        part = min(1.0, t / eases, 4 - t / eases)
        rim = 0.1 * part * p.wheel_radius * p.max_wheel_speed
        for x, y in touch:  # and one on the other side, which does the same
            slip = rim - turning * y, -turning * x
            moment = (slip[0] * y + slip[1] * x) / max(hypot(*slip), 1e-4)
            turning += h * 2 * load * moment / inertia
        heading += h * turning
        told += h * 2 * rim / p.effective_track
        worst = max(worst, abs(heading - told))
    return worst / told


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
        p, by_friction = kind("r").parameters, skidding(touching(kind("r")))
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
    print("\n| inertia, kg m2 | in MuJoCo | in PyBullet |\n|---|---|---|")
    for gears in GEARS:
        kind = type("Geared", (Moose,), {"gears": gears})
        p = kind("r").parameters
        top = 0.1 * p.max_wheel_speed
        turns = [rates(kind, one, -top, top)[1] for one in ENGINES.values()]
        shown = " | ".join(f"{2 * p.wheel_radius * top / turn:.3f} m" for turn in turns)
        print(f"| {gears:g} | {shown} |")
    print("\nBy Coulomb's law a Moose that spins is late by")
    for eases in (0.5, 1.0):
        print(f"{behind(Moose, eases):.1%} where it gathers speed in {eases:g} s")


if __name__ == "__main__":
    main()

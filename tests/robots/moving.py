"""How near the engines bring wheels with rollers, arms and loops to the mathematics.

The figures of docs/measured/accuracy.md: `python -m tests.robots.moving`.
"""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from math import hypot
from time import process_time
from typing import Any

import numpy as np

from rems_net.agents.robot import Definition, Driver, Robot, combine
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.kinematics.wheels import Twist
from rems_net.robots.scaler import Scaler
from rems_net.robots.youbot import TWIST, Youbot, YoubotBase
from tests.drivers.alone import opened

#: where an arm goes, at a quarter of its speed
REACH = {
    "arm/joint/1": 0.6,
    "arm/joint/2": 0.5,
    "arm/joint/3": -0.4,
    "arm/joint/4": 0.4,
    "arm/joint/5": -0.5,
    "arm/gripper": 0.01,
    "arm/speed": 0.25,
}
#: where two arms go, at a tenth of theirs
STRETCH = {
    "left/shoulder": 0.3,
    "left/top": 0.3,
    "left/bottom": 1.2,
    "left/wrist/1": 0.4,
    "left/wrist/2": -0.3,
    "left/wrist/3": 0.4,
    "left/speed": 0.1,
    "right/top": -0.3,
    "right/bottom": 1.8,
    "right/speed": 0.1,
}
WAYS = {
    "ahead": Twist(0.4, 0.0, 0.0),
    "sideways": Twist(0.0, 0.4, 0.0),
    "askew": Twist(-0.2, 0.2, 0.0),
    "about": Twist(0.0, 0.0, 1.0),
    "a curve": Twist(0.3, 0.0, 1.0),
}


def running(
    definition: type[Definition], driver: type[Driver], **settings: Any
) -> AbstractContextManager[Robot]:
    """An open robot, done by this driver."""
    return opened(combine(definition, driver)("r", **settings))


def obey(robot: Robot, command: Mapping[str, Any], dt: float = 0.05) -> None:
    """Let a robot obey for one step."""
    robot.command = command
    robot.drive(robot.command, dt)
    robot.sense()


def astray(
    driver: type[Driver], definition: type[Definition], way: Twist, heading: float
) -> tuple[float, float]:
    """Return how far a base is from its mathematics after 1 s: m, and rad.

    From the moment when it has gathered speed, 0.3 s after it was told.
    """
    initial = {"heading": heading}
    with (
        running(definition, driver, initial=initial) as robot,
        running(definition, Kinematic, options={"integrator": "rk4"}) as model,
    ):
        told = dict(zip(TWIST, way, strict=True))
        for _ in range(6):
            obey(robot, told)
        model.state = {path: robot.state[path] for path in ("x", "y", "heading")}
        for _ in range(20):
            obey(robot, told)
            obey(model, told)
        off = {path: robot.state[path] - model.state[path] for path in ("x", "y")}
        return hypot(*off.values()), abs(robot.state.heading - model.state.heading)


def behind(
    driver: type[Driver], definition: type[Definition], told: Mapping[str, float]
) -> dict[str, float]:
    """Return by how much each joint was off its mathematics at the most, over 2 s."""
    worst = dict.fromkeys((path for path in told if "speed" not in path), 0.0)
    with running(definition, driver) as robot, running(definition, Kinematic) as model:
        for _ in range(40):
            obey(robot, told)
            obey(model, told)
            for path in worst:
                off = abs(robot.state[path] - model.state[path])
                worst[path] = max(worst[path], off)
    return worst


def gap(robot: Any) -> float:
    """Return how far the ends of a robot's loops are apart at the most, m."""
    member = robot.member
    points, turns = member.tree.places(member.instance.joints()[0])
    return max(
        float(
            np.linalg.norm(
                points[second] + turns[second] @ there - points[one] - turns[one] @ at
            )
        )
        for one, at, second, there in member.tree.loops
    )


def main() -> None:
    """Print the figures."""
    for driver in (Mujoco, Pybullet):
        print(driver.__name__)
        for name, way in WAYS.items():
            off = [astray(driver, YoubotBase, way, heading) for heading in (0.0, 0.5)]
            far, turned = (max(one) for one in zip(*off, strict=True))
            print(f"  {name:9} {1000 * far:.2f} mm, {1000 * turned:.2f} mrad off")
        moves: list[tuple[type[Definition], Mapping[str, float]]]
        moves = [(Youbot, REACH), (Scaler, STRETCH)]
        for kind, told in moves:
            worst = behind(driver, kind, told)
            worst.pop("arm/gripper", None)
            print(
                f"  {kind.__name__}: joints {1000 * max(worst.values()):.1f} mrad off"
            )
        with running(Scaler, driver) as robot:
            widest = 0.0
            for _ in range(40):
                obey(robot, STRETCH)
                widest = max(widest, gap(robot))
            print(f"  Scaler: loops {1000 * widest:.3f} mm open")
        with running(Youbot, driver) as robot:
            for _ in range(60):
                obey(robot, {})
            crept = hypot(robot.state["x"], robot.state["y"])
            print(f"  Youbot: stands, and creeps {1000 * crept:.4f} mm in 3 s")
        for kind, told in [(YoubotBase, {"linear/x": 0.2}), *moves]:
            with running(kind, driver) as robot:
                begin = process_time()
                for _ in range(40):
                    obey(robot, told)
                took = (process_time() - begin) / 2
                print(f"  {kind.__name__}: 1 s takes {1000 * took:.0f} ms")


if __name__ == "__main__":
    main()

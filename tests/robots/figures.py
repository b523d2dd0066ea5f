"""The Woodbot's figures of merit, measured: `python -m tests.robots.figures`."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

from rems_net.agents.robot import Driver, Robot, combine
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.robots.woodbot import Woodbot
from tests.drivers.alone import opened
from tests.robots.lab import Row, recording
from tests.robots.webots import RECORDING, distance_from_webots

#: The kinematic model by fine integration, as good as exact.
FINE = {"integrator": "rk4", "substeps": 10}
#: What the class gave its own model.
CLASS = {"track": 0.1, "max_wheel_speed": 6.8}


def woodbot(driver: type[Driver], **settings: Any) -> AbstractContextManager[Robot]:
    """An open Woodbot done by this driver."""
    return opened(combine(Woodbot, driver)("sim", **settings))


def drive(robot: Robot, left: float, right: float, duration: float = 0.1) -> None:
    """Drive at these shares of full speed, -1 to 1, for some steps of 0.1 s."""
    top = robot.parameters.max_wheel_speed
    robot.command = {"wheel/left": left * top, "wheel/right": right * top}
    for _ in range(round(duration / 0.1)):
        robot.drive(robot.command, 0.1)
        robot.sense()


def rates(driver: type[Driver], left: float, right: float, **settings: Any) -> Row:
    """Return each field of the state's change in the second second of driving."""
    with woodbot(driver, **settings) as robot:
        drive(robot, left, right, 1.0)
        before = dict(robot.state)
        drive(robot, left, right, 1.0)
        return {path: robot.state[path] - before[path] for path in before}


def replay(
    driver: type[Driver], rows: Sequence[Mapping[str, float]], **settings: Any
) -> list[Row]:
    """Drive by a recording's input; return the state at each row's timestamp."""
    states = []
    with woodbot(driver, **settings) as robot:
        top, now = robot.parameters.max_wheel_speed, 0.0
        for row in rows:
            robot.command = {
                "wheel/left": row["inpt.wh.l"] / 100 * top,
                "wheel/right": row["inpt.wh.r"] / 100 * top,
            }
            robot.drive(robot.command, row["timestamp"] - now)
            robot.sense()
            now = row["timestamp"]
            states.append(dict(robot.state))
    return states


def webots_distance(driver: type[Driver], **settings: Any) -> float:
    """Return the distance from Webots, fed with Webots' own input, in m."""
    rows = recording(RECORDING)
    states = replay(driver, rows, **settings)
    x, y, heading = ([state[p] for state in states] for p in ("x", "y", "heading"))
    return distance_from_webots(x, y, heading, rows)


def main() -> None:
    """Print the table of docs/measured/accuracy.md."""
    print("| implementation | straight | spin | turn | from Webots |")
    print("|---|---|---|---|---|")
    table: list[tuple[str, type[Driver], dict[str, Any]]] = [
        ("kinematic, the class's constants", Kinematic, {"parameters": CLASS}),
        ("kinematic", Kinematic, {}),
        ("MuJoCo", Mujoco, {}),
        ("PyBullet", Pybullet, {}),
    ]
    for name, driver, settings in table:
        if driver is Kinematic:
            settings = {**settings, "options": FINE}
        straight = rates(driver, 1, 1, **settings)["x"]
        spin = rates(driver, -1, 1, **settings)["heading"]
        turn = rates(driver, 0, 1, **settings)["heading"]
        distance = webots_distance(driver, **settings)
        print(
            f"| {name} | {straight:.4f} m/s | {spin:.3f} rad/s | {turn:.3f} rad/s "
            f"| {distance * 1000:.1f} mm |"
        )


if __name__ == "__main__":
    main()

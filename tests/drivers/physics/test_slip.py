"""Where friction has directions: a robot that starts straight ahead, at any heading."""

from math import degrees, radians

import pytest

from rems_net.agents.robot import Driver
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from tests.drivers.physics.test_physics import ENGINES, needs
from tests.robots.figures import woodbot

STEP = 0.01


def turned(engine: type[Driver], heading: float, rise: float) -> float:
    """Degrees by which it turns, if full speed is reached after `rise` seconds."""
    with woodbot(engine, initial={"heading": radians(heading)}) as robot:
        top = robot.parameters["max_wheel_speed"]
        for n in range(round((rise + 0.1) / STEP)):
            speed = top * min(1.0, (n + 1) * STEP / max(rise, STEP))
            robot.command = {"wheel/left": speed, "wheel/right": speed}
            robot.drive(robot.command, STEP)
        robot.sense()
        return degrees(robot.state["heading"]) - heading


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("heading", [-30, 0, 20, 45, 90])
def test_a_start_without_slip_is_straight(engine: type[Driver], heading: float) -> None:
    assert abs(turned(engine, heading, rise=0.5)) < 0.01


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("heading", [0, 45, 90])
def test_a_start_along_the_axes_is_straight(
    engine: type[Driver], heading: float
) -> None:
    assert abs(turned(engine, heading, rise=0.0)) < 0.001


@needs("pybullet")
@pytest.mark.parametrize(("heading", "by"), [(-30, -0.68), (20, 0.71), (25, 0.74)])
def test_a_start_with_slip_turns_in_bullet(heading: float, by: float) -> None:
    """As docs/woodbot.md says; an engine that mends it is welcome to fail this."""
    assert turned(Pybullet, heading, rise=0.0) == pytest.approx(by, abs=0.02)


@needs("mujoco")
@pytest.mark.parametrize("heading", [-30, 20, 25])
def test_a_start_with_slip_is_straight_in_mujoco(heading: float) -> None:
    assert abs(turned(Mujoco, heading, rise=0.0)) < 0.001

"""What is wrong with a definition or a world is told before Webots moves."""

import sys
from typing import Any

import pytest

from rems_net import Definition, In, Out, Schema
from rems_net.agents.robot import combine
from rems_net.bodies.devices import Devices, Motor
from rems_net.defdict import length
from rems_net.drivers.webots.webots import Webots
from rems_net.errors import AgentError, SchemaError
from rems_net.robots.woodbot import Woodbot
from tests.drivers.webots.conftest import World
from tests.drivers.webots.models import EPUCK, WOODBOT
from tests.drivers.webots.test_webots import drive, opened


def test_a_definition_that_says_nothing_of_webots() -> None:
    class Bare(Definition):
        command = In(Schema("bare.command", {"x": length()}))
        state = Out(Schema("bare.state", {"x": length()}))

    with pytest.raises(SchemaError, match=r"Bare has no webots\(\): the driver Webots"):
        combine(Bare, Webots)("w").prepare()


def test_a_definition_that_names_a_field_that_it_has_not(world: World) -> None:
    class Wrong(Woodbot):
        def webots(self) -> Devices:
            return Devices(motors=(Motor("motor_l", "wheel/lft"),))

    world(WOODBOT)
    said = r"webots\(\) names the field 'wheel/lft' of command\. .*'wheel/left'\?"
    with pytest.raises(SchemaError, match=said):
        combine(Wrong, Webots)("w").prepare()


def failure(world: World, model: dict[str, Any], **more: Any) -> str:
    world(model, **more)
    with pytest.raises(AgentError) as caught:
        opened()
    return str(caught.value)


def test_another_robot_is_there(world: World) -> None:
    world(EPUCK)
    with pytest.raises(SchemaError) as caught:
        opened()
    said = str(caught.value)
    assert said.startswith(
        "'e-puck' of Webots has no motor 'motor_r'; it has left wheel motor, "
    )
    assert said.endswith("is it another robot? Name it by the option robot. (R0315)")


def test_its_supervisor_is_false(world: World) -> None:
    said = failure(world, WOODBOT, supervisor=False)
    assert "`supervisor` of 'woodbot' is FALSE" in said
    assert "Set it to TRUE, save the world, and reload it." in said


def test_steps_that_no_controller_counts(world: World) -> None:
    assert "basicTimeStep is 0.5 ms" in failure(world, WOODBOT, step=0.5)


def test_a_coordinate_system_that_nobody_knows(world: World) -> None:
    said = failure(world, WOODBOT, system="EUN")
    assert "the world's coordinateSystem is 'EUN'; expected ENU or NUE. Set it" in said


def test_webots_ends(world: World) -> None:
    world(WOODBOT, quits_after=1.2)
    robot = opened()
    with pytest.raises(AgentError, match="Webots has ended this robot's controller"):
        drive(robot, 0.1, 0.1, 10)
    robot.close()


def test_two_in_a_process(world: World) -> None:
    world(WOODBOT)
    robot = opened()
    other = combine(Woodbot, Webots)("v")
    other.prepare()
    with pytest.raises(AgentError, match="robot/w is in the same process, and that"):
        other.open()
    other.close()
    drive(robot, 0.1, 0.1, 1)  # and it has not lost what it holds
    robot.close()


def test_what_is_missing_or_slow_there_is_told(
    world: World, capsys: pytest.CaptureFixture[str]
) -> None:
    slow = WOODBOT | {"sensors": {}, "max_speed": 5.0}
    world(slow)
    robot = opened()
    drive(robot, 0.1, 0.1, 1)
    robot.close()
    said = capsys.readouterr().err
    assert (
        "'motor_r' of Webots turns at most 5 rad/s, and wheel/left goes up to" in said
    )
    assert (
        "no device of Webots' robot measures sensors/lidar/front, sensors/lid" in said
    )


def test_nothing_of_webots_is_loaded_before_it_is_used(world: World) -> None:
    world(WOODBOT)
    combine(Woodbot, Webots)("w").prepare()
    assert "controller" not in sys.modules

"""Robots inside Transforms of a Webots world, and worlds whose y is up."""

from typing import Any

import pytest

from rems_net.agents.robot import Definition
from rems_net.robots.pioneer import Pioneer3DX
from rems_net.robots.woodbot import Woodbot
from tests.drivers.webots.conftest import World
from tests.drivers.webots.models import PIONEER_3DX, WOODBOT
from tests.drivers.webots.test_webots import START, course, opened

#: the Transform around the robot in the class's world
CLASS = {"rotation": [1, 0, 0, 1.57]}
AWAY = {"translation": [3.0, -2.0, 0.7], "rotation": [0.6, 0.0, 0.8, 2.2]}
NESTED: dict[str, dict[str, Any]] = {
    "class": {"parents": [CLASS]},
    "identity": {"parents": [{}, {}]},
    "levels": {"parents": [AWAY, CLASS, {}, AWAY]},
    "half a turn": {"parents": [{"rotation": [0, 0, 1, 3.141592653589793]}]},
    "scale": {"parents": [AWAY | {"scale": [2, 2, 2]}]},
    "y up": {"system": "NUE"},
    "y up, nested": {"system": "NUE", "parents": [AWAY, CLASS]},
}


def driven(world: World, **nest: Any) -> list[list[float]]:
    """Open, drive, and drive again after a reset: the states, and the last sensors."""
    world(WOODBOT, **nest)
    robot = opened(initial=START)
    assert robot.state.to_dict() == START
    seen = []
    for _ in range(2):
        course(robot)
        seen.append(robot.state.to_array().tolist())
        robot.reset()
    robot.sense()
    robot.close()
    return [*seen, robot.sensors.to_array().tolist()]


@pytest.mark.parametrize("nest", NESTED.values(), ids=NESTED)
def test_a_nested_robot_drives_as_one_that_is_not(
    world: World, nest: dict[str, Any]
) -> None:
    expected = driven(world)
    for found, wanted in zip(driven(world, **nest), expected, strict=True):
        assert found == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize(
    ("definition", "model"), [(Woodbot, WOODBOT), (Pioneer3DX, PIONEER_3DX)]
)
def test_the_fields_are_relative_to_the_parent(
    world: World, definition: type[Definition], model: dict[str, Any]
) -> None:
    """What Webots reports in the world is where the robot was to be."""
    world(model, **NESTED["levels"])
    robot = opened(definition, initial=START)
    robot._go_on(1)
    there = robot._robot
    assert (there.x, there.y) == pytest.approx((START["x"], START["y"]))
    assert there.heading == pytest.approx(START["heading"])
    own = robot._node.getField("translation").getSFVec3f()
    assert abs(own[0] - robot._node.getPosition()[0]) > 0.1
    robot.close()

"""The Woodbot's definition: what it says about itself, without any driver."""

from math import pi, sqrt
from typing import Any

import pytest

from rems_net.bodies.body import Ray, lump
from rems_net.errors import FieldValueError
from rems_net.robots.woodbot import Woodbot


def bot(**parameters: Any) -> Woodbot:
    robot = Woodbot("bot", parameters=parameters)
    robot.prepare()
    return robot


def read(robot: Woodbot, x: float, y: float, heading: float) -> dict[str, float]:
    robot.state = {"x": x, "y": y, "heading": heading}
    return robot.measure(robot.state, robot.command)


def test_ports() -> None:
    assert Woodbot.state.schema.paths == ("x", "y", "heading")
    assert bot().command.schema.paths == ("wheel/left", "wheel/right")
    assert Woodbot.sensors.schema.paths == (
        "lidar/front",
        "lidar/right",
        "compass/x",
        "compass/y",
        "gyro/z",
    )


def test_the_command_goes_to_full_speed_and_no_further() -> None:
    robot = bot(max_wheel_speed="6.8 rad/s")
    robot.command = {"wheel/left": "100 percent", "wheel/right": -6.8}
    assert robot.command["wheel/left"] == 6.8
    with pytest.raises(FieldValueError, match=r"6\.8"):
        robot.command = {"wheel/left": 6.9}


def test_derivative() -> None:
    robot = bot(track=0.1, wheel_radius=0.02)
    robot.state = {"heading": pi / 2}
    robot.command = {"wheel/left": 2.0, "wheel/right": 4.0}
    rates = robot.derivative(robot.state, robot.command)
    assert rates == {
        "x": pytest.approx(0.0),
        "y": pytest.approx(0.06),
        "heading": pytest.approx(0.4),
    }


def test_lidars_at_the_origin() -> None:
    robot = bot()
    for heading in (0.0, 1.0, -2.0):
        seen = read(robot, 0, 0, heading)
        assert seen["lidar/front"] == pytest.approx(0.4 - 0.00825)
        assert seen["lidar/right"] == pytest.approx(sqrt(0.4**2 - 0.03575**2))


def test_lidars_off_the_origin() -> None:
    seen = read(bot(lidar_front=0, lidar_right=0), 0.1, 0.2, 0.0)
    assert seen["lidar/front"] == pytest.approx(sqrt(0.16 - 0.04) - 0.1)
    assert seen["lidar/right"] == pytest.approx(sqrt(0.16 - 0.01) + 0.2)


def test_lidars_outside_the_arena() -> None:
    robot = bot(lidar_front=0, lidar_right=0)
    seen = read(robot, -1.0, 0.0, 0.0)
    assert seen["lidar/front"] == pytest.approx(0.6)  # the wall from outside
    assert seen["lidar/right"] == 1.2  # past it
    assert read(robot, 1.0, 0.0, 0.0)["lidar/front"] == 1.2  # behind it


def test_lidars_without_an_arena_see_their_reach() -> None:
    seen = read(bot(arena_radius=0, lidar_reach="80 cm"), 0.0, 0.0, 0.0)
    assert (seen["lidar/front"], seen["lidar/right"]) == (0.8, 0.8)


def test_the_compass_points_to_plus_y() -> None:
    ahead = read(bot(), 0, 0, pi / 2)
    assert ahead["compass/x"] == 1.0
    assert ahead["compass/y"] == pytest.approx(0.0)
    left = read(bot(), 0, 0, 0.0)
    assert (left["compass/x"], left["compass/y"]) == (0.0, 1.0)


@pytest.mark.parametrize("parameters", [{}, {"mass": 0.15, "centre_of_mass": -0.02}])
def test_the_body_weighs_what_the_parameters_say(parameters: dict[str, float]) -> None:
    robot = bot(**parameters)
    body = robot.body()
    wheels = [(part, hinge.at) for hinge in body.joints for part in hinge.parts]
    rigid = lump(body.parts)
    total = rigid.mass + sum(part.mass for part, _ in wheels)
    moment = rigid.mass * rigid.centre + sum(p.mass * p.at[0] for p, _ in wheels)
    assert total == pytest.approx(robot.parameters.mass)
    assert moment[0] / total == pytest.approx(robot.parameters.centre_of_mass)
    assert rigid.centre[1] == pytest.approx(0.0)
    # By shape and spread the yaw inertia is about that of the Webots robot.
    assert 0.5e-4 < rigid.inertia[2, 2] < 3e-4


def test_the_body_stands_on_wheels_and_tail() -> None:
    body = bot().body()
    assert {hinge.at[2] for hinge in body.joints} == {0.0}
    assert body.height == bot().parameters.wheel_radius
    tail = body.parts[1]
    assert tail.at[2] - 0.003 == pytest.approx(-body.height)
    assert [sensor.name for sensor in body.sensors] == list(
        Woodbot.sensors.schema.paths
    )
    rays = [sensor for sensor in body.sensors if isinstance(sensor, Ray)]
    assert [ray.direction for ray in rays] == [(1, 0, 0), (0, -1, 0)]

"""The kinematic driver: the class's own model, to the last bits, and better ones."""

from math import pi
from typing import Any

import pytest

from rems_net.agents.ports import In, Out
from rems_net.agents.robot import Definition, combine
from rems_net.defdict import DefDict, Schema, length, velocity
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.errors import SchemaError, UnknownFieldError
from tests.robots.figures import CLASS, drive, rates, replay, woodbot
from tests.robots.lab import models, recording

#: The class's model has its lidars on the axle; its arena is the Woodbot's default.
ON_AXLE = {"lidar_front": 0.0, "lidar_right": 0.0}


class Cart(Definition):
    command = In(Schema("cart.command", {"speed": velocity(range=(-1, 1))}))
    state = Out(Schema("cart.state", {"x": length(), "width": length(default=0.3)}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, float]:
        return {"x": command["speed"]}


@pytest.mark.parametrize("name", models())
def test_reproduces_the_class_model(name: str) -> None:
    rows = recording(name)
    states = replay(Kinematic, rows, parameters=CLASS)
    for row, state in zip(rows, states, strict=True):
        assert state["x"] == pytest.approx(row["state.x"], abs=1e-12)
        assert state["y"] == pytest.approx(row["state.y"], abs=1e-12)
        assert state["heading"] == pytest.approx(row["state.th_z"], abs=1e-12)


@pytest.mark.parametrize("name", models())
def test_reproduces_the_class_sensors(name: str) -> None:
    with woodbot(Kinematic, parameters=CLASS | ON_AXLE) as robot:
        for row in recording(name):
            at = {"x": row["state.x"], "y": row["state.y"]}
            robot.state = {**at, "heading": row["state.th_z"]}
            robot.sense()
            read = robot.sensors
            reach = robot.parameters.lidar_reach
            for ours, theirs in (("front", "lidar_f"), ("right", "lidar_r")):
                expected = min(row[f"outpt.{theirs}"], reach)
                assert read[f"lidar/{ours}"] == pytest.approx(expected, abs=1e-12)
            assert read["compass/x"] == pytest.approx(row["outpt.mag_x"], abs=1e-12)
            assert read["compass/y"] == pytest.approx(row["outpt.mag_y"], abs=1e-12)


@pytest.mark.parametrize(
    ("parameters", "straight", "spin", "turn"),
    [
        (CLASS, 0.136, 2.72, 1.36),
        ({"track": 0.1126, "max_wheel_speed": 8.0}, 0.160, 2.842, 1.421),
    ],
)
def test_full_speed(
    parameters: dict[str, float], straight: float, spin: float, turn: float
) -> None:
    def rate(left: float, right: float) -> dict[str, float]:
        return rates(Kinematic, left, right, parameters=parameters)

    assert rate(1, 1)["x"] == pytest.approx(straight, abs=1e-9)
    assert rate(-1, 1)["heading"] == pytest.approx(spin, abs=5e-4)
    assert rate(0, 1)["heading"] == pytest.approx(turn, abs=5e-4)


def quarter(**options: Any) -> tuple[float, float]:
    """Where a quarter of a circle about the left wheel ends, relative to it."""
    with woodbot(Kinematic, options=options) as robot:
        p = robot.parameters
        top = p.max_wheel_speed
        robot.command = {"wheel/left": 0.0, "wheel/right": top}
        robot.drive(robot.command, pi / 2 * p.track / (p.wheel_radius * top))
        assert robot.state["heading"] == pytest.approx(pi / 2, abs=1e-12)
        return robot.state["x"] / (p.track / 2), robot.state["y"] / (p.track / 2)


def test_one_euler_step_goes_straight_on() -> None:
    x, y = quarter()
    assert x == pytest.approx(pi / 2)
    assert y == 0.0


def test_substeps_bring_euler_closer() -> None:
    errors = [abs(quarter(substeps=n)[0] - 1.0) for n in (10, 20, 40)]
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(2, rel=0.1)


def test_rk4_is_of_fourth_order() -> None:
    errors = [abs(quarter(integrator="rk4", substeps=n)[0] - 1.0) for n in (2, 4, 8)]
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(16, rel=0.2)


@pytest.mark.parametrize("integrator", ["euler", "rk4"])
def test_a_field_without_a_rate_stays_as_it_is(integrator: str) -> None:
    cart = combine(Cart, Kinematic)(
        "c", options={"integrator": integrator}, initial={"width": 0.2}
    )
    cart.prepare()
    cart.drive(cart.command.schema({"speed": 0.5}), 2.0)
    cart.sense()
    assert dict(cart.state) == {"x": pytest.approx(1.0), "width": 0.2}


def test_reset_goes_back_to_the_initial_state() -> None:
    with woodbot(Kinematic, initial={"x": 0.1, "heading": "90 deg"}) as robot:
        before = dict(robot.state), robot.sensors.copy()
        drive(robot, 0.2, 1.0, 1.0)
        assert dict(robot.state) != before[0]
        robot.reset()
        assert (dict(robot.state), robot.sensors) == before


def test_the_gyro_tells_the_command_that_was_driven() -> None:
    with woodbot(Kinematic, parameters=CLASS) as robot:
        drive(robot, -1, 1)
        assert robot.sensors["gyro/z"] == pytest.approx(2.72)


def test_a_definition_without_derivative_is_told_what_to_write() -> None:
    class Statue(Definition):
        command, state = Cart.command, Cart.state

    with pytest.raises(
        SchemaError, match=r"Statue has no derivative.*Kinematic"
    ) as why:
        combine(Statue, Kinematic)("s").prepare()
    assert "def derivative(self, state, command):" in str(why.value)


def test_a_rate_of_an_unknown_field_is_found_before_the_start() -> None:
    class Misspelt(Cart):
        def derivative(self, state: DefDict, command: DefDict) -> dict[str, float]:
            return {"widht": command["speed"]}

    with pytest.raises(UnknownFieldError, match="Did you mean 'width'"):
        combine(Misspelt, Kinematic)("m").prepare()


def test_sensors_without_measure_are_told_what_to_write() -> None:
    class Blind(Cart):
        sensors = Out(Schema("blind.sensors", {"range": length()}))

    with pytest.raises(SchemaError, match=r"Blind has no measure.*Kinematic"):
        combine(Blind, Kinematic)("b").prepare()

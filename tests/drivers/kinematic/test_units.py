"""Units inside `derivative`, and initial angles: what could be either is refused."""

from collections.abc import Callable
from typing import Any

import pytest

from rems_net import Definition, Experiment, In, Out, Schema
from rems_net.defdict import DefDict, Field, angle, angular_velocity, length, velocity
from rems_net.errors import RemsError, uncoded
from rems_net.units import deg, s

Rates = Callable[[DefDict, DefDict], dict[str, Any]]
TURN = (
    "'turn' of the command, on which it depends, is a number in deg/s. Have 'turn' in "
    "rad/s: angular_velocity(), to which commands are converted; or return the rate "
    'with its unit, such as "0.5 {}" or command["turn"] * deg / s.'
)


def cart(turn: Field, x: Field, rates: Rates) -> Experiment:
    class Cart(Definition):
        command = In(Schema("command", {"speed": velocity(), "turn": turn}))
        state = Out(Schema("state", {"x": x, "heading": angle()}))

        def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
            return rates(state, command)

    lab = Experiment("cart", dt="0.1 s")
    lab.robot("cart", Cart, "kinematic")
    return lab


@pytest.mark.parametrize(
    ("turn", "x", "rates", "sentence"),
    [
        (
            "rad/s",
            "mm",
            lambda state, command: {"x": command["speed"]},
            "for 'x', and the state has it in mm: that could be in m/s or in mm/s. "
            'Write the unit, such as "0.5 m/s" or 30 * mm / s, or have it in m: '
            "length().",
        ),
        (
            "deg/s",
            "m",
            lambda state, command: {"heading": command["turn"]},
            f"for 'heading', and {TURN.format('rad/s')}",
        ),
        (
            "deg/s",
            "m",
            lambda state, command: {"x": 0.1 * command["turn"] * state["heading"]},
            f"for 'x', and {TURN.format('m/s')}",
        ),
    ],
)
def test_a_plain_number_that_could_be_either(
    turn: str, x: str, rates: Rates, sentence: str
) -> None:
    lab = cart(angular_velocity(turn), length(x), rates)
    with pytest.raises(RemsError) as caught:
        lab.check()
    assert "Cart.derivative (test_units.py, line" in str(caught.value)
    assert uncoded(caught.value).endswith(f"returns 0.0 {sentence}")


@pytest.mark.parametrize(
    ("rates", "turned"),
    [
        (lambda state, command: {"heading": command["turn"] * deg / s}, 0.17453292),
        (lambda state, command: {"heading": "0.5 rad/s"}, 0.1),
        # What does not depend on the command in deg/s is in no doubt.
        (lambda state, command: {"heading": 2 * command["speed"]}, 0.2),
        (lambda state, command: {"heading": 1.0, "x": command["turn"] * 0}, 0.2),
    ],
)
def test_rates_that_are_clear(rates: Rates, turned: float) -> None:
    with cart(angular_velocity("deg/s"), length(), rates).engine() as engine:
        engine.put("robot/cart/command", {"speed": 0.5, "turn": "50 deg/s"})
        engine.step(2)
        assert engine["robot/cart"].state["heading"] == pytest.approx(turned)


def test_a_command_in_degrees_is_converted_for_a_robot_in_radians() -> None:
    def rates(state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"heading": command["turn"]}

    with cart(angular_velocity(), length(), rates).engine() as engine:
        engine.put("robot/cart/command", {"turn": "50 deg/s"})
        engine.step(2)
        assert engine["robot/cart"].state["heading"] == pytest.approx(0.17453292)

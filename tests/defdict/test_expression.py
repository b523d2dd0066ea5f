"""Expressions are calculated in SI units, and know the unit of their result."""

from __future__ import annotations

import numpy as np
import pytest

from rems_net.defdict.expression import Moment, Names, compiled
from rems_net.defdict.schema import Schema
from rems_net.errors import RemsError
from rems_net.units import angle, array, choice, force, length, velocity

STATE = Schema(
    "state",
    {
        "x": length("mm"),
        "speed": velocity("m/s"),
        "turn": angle("deg"),
        "push": force("N"),
        "scan": array(3, "cm"),
        "gait": choice("roll", "walk"),
    },
)
NAMES = Names({"robot/sim/state": STATE, "robot/sim/command": STATE})
#: at two ticks
VALUES = {
    **{"x": np.array([500.0, 250.0]), "speed": np.array([1.0, 3.0])},
    **{"turn": np.array([0.0, 180.0]), "push": np.array([2.0, 4.0])},
    "scan": np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]),
}


@pytest.mark.parametrize(
    ("text", "unit", "last"),
    [
        ("x", "m", 0.25),
        ("max(x) - 10 cm", "m", 0.4),
        ("min(x, 40 cm)", "m", 0.25),
        ("mean(speed)", "m/s", 2.0),
        ("x / speed", "s", 0.25 / 3),
        ("speed * speed / x", "m/s**2", 36.0),
        ("x**2 < 0.1 m**2", "", True),
        ("first(turn) + turn", "rad", np.pi),
        ("2 * push", "N", 8.0),
        ("push * x", "m**2*kg/s**2", 1.0),
        ("push / 2", "N", 2.0),
        ("1 / speed", "s/m", 1 / 3),
        ("scan[2]", "m", 0.06),
        ("not x > 1 m and speed > 1 m/s", "", True),
    ],
)
def test_units_and_values(text: str, unit: str, last: float) -> None:
    made = compiled(text, NAMES, lasting=True)
    now = Moment(NAMES, {"robot/sim/state": VALUES})
    found = np.asarray(made.value(now, now))
    assert made.unit == unit
    assert (found[-1] if found.ndim else found) == pytest.approx(last)
    assert {port for port, _ in made.places} == {"robot/sim/state"}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("scan", "scan is an array; name one element, such as scan[0]"),
        ("x[0]", "x is no array, x[0]"),
        ("gait", "gait is no number"),
        ("before.x", "'before.x' is no value here; there is sim.state.x, "),
        ("sin(x)", "sin() takes a number without a unit"),
        ("push + turn", "in 'push + turn' N and rad do not fit"),
        ("x > 20 cm and 0.5", "'0.5' is a number, neither true nor false"),
        ("turn + 20 cm > 1", "in 'turn + 20 cm' rad and m do not fit"),
        ("quantity__0", "'quantity__0' is no value here"),
        ("9**9**9", "cannot be calculated here"),
        ("lambda: 1", "cannot be calculated here"),
        ("", "it is no expression"),
    ],
)
def test_what_cannot_be_calculated(text: str, sentence: str) -> None:
    with pytest.raises(RemsError) as caught:
        compiled(text, NAMES, lasting=True)
    assert sentence in str(caught.value)


def test_a_name_of_several_values() -> None:
    names = Names({"robot/a/state": STATE, "robot/b/state": STATE})
    with pytest.raises(RemsError, match=r"more of its name, such as a\.state\.x, b\."):
        compiled("x", names)
    assert compiled("b.state.x", names).places == [("robot/b/state", "x")]

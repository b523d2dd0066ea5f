"""The mistakes that a first-year student makes, and the sentence each one gets.

They are those of an afternoon in the lab, and what was observed in REMS 0.3.2 and must
never come back. Texts are exact: they are part of the user interface.
"""

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rems_net.defdict import (
    Schema,
    angle,
    angular_velocity,
    array,
    boolean,
    choice,
    integer,
    length,
    percent,
)
from rems_net.errors import (
    ConversionError,
    FieldValueError,
    FixedKeysError,
    RemsError,
    SchemaError,
    UnitError,
    UnknownFieldError,
    WireError,
)

unyt: Any = importlib.import_module("unyt")

SPEED = angular_velocity("rad/s", range=(-8, 8))
COMMAND = Schema("woodbot.command", {"wheel": {"left": SPEED, "right": SPEED}})
STATE = Schema("woodbot.state", {"x": length("m"), "y": length("m"), "a": angle("rad")})
SETUP = Schema(
    "setup",
    {
        "steps": integer(range=(1, 1000)),
        "solver": choice("euler", "rk4"),
        "record": boolean(),
        "gains": array(3),
        "reach": length("m", range=(0, 2)),
    },
)


def put(schema: Schema, path: str, value: Any) -> Callable[[], None]:
    return lambda: schema().__setitem__(path, value)


MISTAKES: dict[str, tuple[Callable[[], Any], type[RemsError], str]] = {
    "a misspelt field": (
        put(STATE, "z", 1.0),
        UnknownFieldError,
        "woodbot.state has no field 'z'. It has 'x', 'y', 'a'. (R0104)",
    ),
    "a misspelt path": (
        put(COMMAND, "wheel/lefft", 1.0),
        UnknownFieldError,
        "woodbot.command has no field 'wheel/lefft'. Did you mean 'wheel/left'? "
        "(R0104)",
    ),
    "a dot instead of a slash": (
        put(COMMAND, "wheel.left", 1.0),
        UnknownFieldError,
        "woodbot.command has no field 'wheel.left'. Did you mean 'wheel/left'? (R0104)",
    ),
    "the name without its group": (
        put(COMMAND, "left", 1.0),
        UnknownFieldError,
        "woodbot.command has no field 'left'. Did you mean 'wheel/left'? (R0104)",
    ),
    "a misspelt attribute": (
        lambda: setattr(COMMAND().wheel, "lft", 1.0),
        UnknownFieldError,
        "woodbot.command has no field 'wheel/lft'. Did you mean 'wheel/left'? (R0104)",
    ),
    "faster than the wheel": (
        put(COMMAND, "wheel/left", 12),
        FieldValueError,
        "woodbot.command: 'wheel/left' expects a number in rad/s from -8 to 8, but got "
        "12. To limit it, use clip(). (R0101)",
    ),
    "degrees, without saying so": (
        put(COMMAND, "wheel/left", 180.0),
        FieldValueError,
        "woodbot.command: 'wheel/left' expects a number in rad/s from -8 to 8, but got "
        '180.0. Did you mean "180 deg/s"? To limit it, use clip(). (R0101)',
    ),
    "a number as text": (
        put(STATE, "x", "2"),
        FieldValueError,
        "woodbot.state: 'x' expects a number in m, but got '2'. Type 2 without quotes, "
        'or with its unit: "2 m". (R0101)',
    ),
    "the wrong kind of unit": (
        put(STATE, "x", "2 deg"),
        UnitError,
        "woodbot.state: 'x' expects a number in m, but got '2 deg': deg (angle) cannot "
        'become m (length). Type a number in m, or a text such as "1.5 m". (R0102)',
    ),
    "a misspelt unit": (
        put(STATE, "x", "2 meterz"),
        UnitError,
        "woodbot.state: 'x' expects a number in m, but got '2 meterz': 'meterz' is not "
        "a unit that unyt knows. Did you mean 'meter'? Type a number in m, or a text "
        'such as "1.5 m". (R0102)',
    ),
    "metres per second into radians per second": (
        put(COMMAND, "wheel/left", 2 * unyt.m / unyt.s),
        UnitError,
        "woodbot.command: 'wheel/left' expects a number in rad/s from -8 to 8, but got "
        "2 m/s: m/s (velocity) cannot become rad/s (angular "
        'velocity). Type a number in rad/s, or a text such as "1.5 rad/s". (R0102)',
    ),
    "percent where there is no range": (
        put(STATE, "x", "50 percent"),
        UnitError,
        "woodbot.state: 'x' expects a number in m, but got '50 percent': percent is a "
        "share of a range, and this field has no range. Type a number in m, or a text "
        'such as "1.5 m". (R0102)',
    ),
    "a list for one value": (
        put(STATE, "x", [1, 2]),
        FieldValueError,
        "woodbot.state: 'x' expects a number in m, but got [1, 2]. (R0101)",
    ),
    "one value too few": (
        lambda: STATE([1, 2]),
        FieldValueError,
        "woodbot.state has 3 fields ('x', 'y', 'a'), but 2 values came. Give one "
        "for each, or name some in a dict. (R0107)",
    ),
    "an array of the wrong length": (
        put(SETUP, "gains", [1, 2, 3, 4]),
        FieldValueError,
        "setup: 'gains' expects an array of 3 numbers, but got [1, 2, 3, 4]. Its shape "
        "is (4,), not (3,). (R0101)",
    ),
    "half a step": (
        put(SETUP, "steps", 2.5),
        FieldValueError,
        "setup: 'steps' expects a whole number from 1 to 1000, but got 2.5. "
        "Use round(). (R0101)",
    ),
    "a choice that is none": (
        put(SETUP, "solver", "rk45"),
        FieldValueError,
        "setup: 'solver' expects one of 'euler', 'rk4', but got 'rk45'. Did you mean "
        "'rk4'? (R0101)",
    ),
    "yes instead of True": (
        put(SETUP, "record", "yes"),
        FieldValueError,
        "setup: 'record' expects True or False, but got 'yes'. Write True or False. "
        "(R0101)",
    ),
    "a sensor that divided by zero": (
        put(SETUP, "gains", [0.0, np.nan, 0.0]),
        FieldValueError,
        "setup: 'gains'[1] expects a number, but got nan. (R0101)",
    ),
    "a group with a word that is misspelt": (
        put(COMMAND, "wheel", {"lft": 1.0, "right": 1.0}),
        UnknownFieldError,
        "woodbot.command has no field 'wheel/lft'. Did you mean 'wheel/left'? (R0104)",
    ),
    "an input wired to the wrong port": (
        lambda: STATE.converter(COMMAND),
        ConversionError,
        "woodbot.state cannot become woodbot.command:\n"
        "  - nothing gives 'wheel/left' (rad/s -8..8). Add a rule, or ask for its "
        "default with missing='default'.\n"
        "  - nothing gives 'wheel/right' (rad/s -8..8). Add a rule, or ask for its "
        "default with missing='default'. (R0117)",
    ),
    "a definition with a number for a field": (
        lambda: Schema("my.robot", {"radius": 0.02}),
        SchemaError,
        "my.robot/radius must be a field such as length('m'), or a dict of fields; got "
        "0.02. (R0112)",
    ),
    "True for 1": (
        put(STATE, "x", True),
        FieldValueError,
        "woodbot.state: 'x' expects a number in m, but got True. Write 1 if you mean "
        "the number. (R0101)",
    ),
    "del": (
        lambda: STATE().pop("x"),
        FixedKeysError,
        "the keys of woodbot.state are fixed by its schema and cannot be removed. "
        "dict(value) is a dict of its own. (R0106)",
    ),
    "a range the wrong way round": (
        lambda: length("m", range=(2, 0)),
        SchemaError,
        "a range goes from low to high; got (2, 0). (R0110)",
    ),
    "JSON instead of msgpack": (
        lambda: STATE.decode(b'{"x":1}'),
        WireError,
        "woodbot.state: the payload is not one msgpack map: unpack(b) received extra "
        "data. It looks like JSON. (R0123)",
    ),
    # What REMS 0.3.2 took without a word.
    "two seconds for metres": (
        put(STATE, "x", 2 * unyt.second),
        UnitError,
        "woodbot.state: 'x' expects a number in m, but got 2 s: s (time) cannot become "
        'm (length). Type a number in m, or a text such as "1.5 m". (R0102)',
    ),
    "hello for a length": (
        put(STATE, "x", "hello"),
        FieldValueError,
        "woodbot.state: 'x' expects a number in m, but got 'hello'. Type a number, "
        'such as 1.5 or "1.5 m". (R0101)',
    ),
    "bananas": (
        put(STATE, "x", "3 bananas"),
        UnitError,
        "woodbot.state: 'x' expects a number in m, but got '3 bananas': 'bananas' is "
        "not a unit that unyt knows. Type a number in m, or a text such as "
        '"1.5 m". (R0102)',
    ),
    "out of range": (
        put(SETUP, "reach", 3.0),
        FieldValueError,
        "setup: 'reach' expects a number in m from 0 to 2, but got 3.0. To limit it, "
        "use clip(). (R0101)",
    ),
    "a key that is unknown among others": (
        lambda: STATE().update({"x": 1, "typo": 9}),
        UnknownFieldError,
        "woodbot.state has no field 'typo'. It has 'x', 'y', 'a'. (R0104)",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_first_year_mistake(mistake: str) -> None:
    make, kind, says = MISTAKES[mistake]
    with pytest.raises(kind) as caught:
        make()
    assert str(caught.value) == says


# -- what else REMS 0.3.2 did ---------------------------------------------------------


def test_250_cm_in_a_metre_field_is_2_5() -> None:
    value = STATE()
    value.x = 250 * unyt.cm
    assert value.x == 2.5
    assert value.encode() == STATE(x=2.5).encode()


def test_percent_means_percent_of_the_range() -> None:
    value = COMMAND()
    value["wheel/left"] = 50 * unyt.percent
    assert value.wheel.left == 4.0
    keys = Schema("keys", {"wheel": {"left": percent(), "right": percent()}})
    assert keys({"wheel/left": 50}).to(COMMAND) == value

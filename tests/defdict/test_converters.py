"""Converters: their policies, what they take, how they explain themselves."""

import importlib

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
    number,
    percent,
    velocity,
)
from rems_net.errors import ConversionError, DimensionError, WireError
from tests.defdict.test_conversion import one


def test_a_refusal_names_both_ends_and_every_reason() -> None:
    keys = Schema("keys", {"speed": length("m"), "turn": angle("rad")})
    robot = Schema("woodbot.command", {"speed": velocity("m/s"), "turns": angle()})
    with pytest.raises(DimensionError) as caught:
        keys.converter(
            robot,
            source_label="input/keys/value",
            target_label="robot/sim/command",
        )
    assert str(caught.value) == (
        "input/keys/value (keys) cannot become robot/sim/command (woodbot.command):\n"
        "  - 'speed': m (length) cannot become m/s (velocity).\n"
        "  - nothing gives 'turns' (rad). Did you mean 'turn'? Connect what has it, or "
        "a process that makes it. (R0117)"
    )


def test_missing_and_surplus_by_policy() -> None:
    a = Schema("a", {"x": length("m"), "z": length()})
    b = Schema("b", {"x": length("mm"), "y": length(default=5)})
    with pytest.raises(ConversionError, match="nothing gives 'y'"):
        a.converter(b)
    made = a.converter(b, missing="default")
    assert made({"x": 1}) == {"x": 1000.0, "y": 5.0}
    with pytest.raises(ConversionError, match="'z' would be dropped"):
        a.converter(b, missing="default", surplus="error")
    with pytest.raises(ConversionError, match="missing= is 'error' or 'default'"):
        a.converter(b, missing="ignore")
    with pytest.raises(ConversionError, match="surplus= is 'drop' or 'error'"):
        a.converter(b, surplus="keep")


def test_converter_takes_values_dicts_and_payloads() -> None:
    a, b = one(length("mm"), "a"), one(length("m"), "b")
    convert = a.converter(b)
    assert convert(a(x=1)).x == 0.001
    assert convert({"x": "1 m"}).x == 1.0
    assert convert.decode(a(x=1).encode()).x == 0.001
    assert convert is a.converter(b)
    with pytest.raises(ConversionError, match="this converter takes a@"):
        convert(b())
    with pytest.raises(WireError, match=r"^a: "):
        convert.decode(b"")
    assert a(x=5).to(a) == {"x": 5.0}


def test_converted_values_share_nothing() -> None:
    a = one(length("mm"), "a")
    value = a(x=5)
    other = value.to(a)
    other.x = 6.0
    assert value.x == 5.0


def test_explain_and_code_are_readable() -> None:
    a = Schema("keys", {"wheel": {"left": percent()}, "x": length("mm")})
    b = Schema(
        "robot",
        {"wheel": {"left": angular_velocity(range=(-8, 8))}, "x": length("m")},
    )
    assert a.explain(b) == (
        "keys to robot\n"
        "  field       from               to           factor           rule\n"
        "  wheel/left  percent -100..100  rad/s -8..8  x * 8.0 / 100.0\n"
        "  x           mm                 m            x / 1000.0"
    )
    assert a.converter(b).code == (
        "def convert(leaves):\n"
        "    v0, v1,  = leaves\n"
        "    t0 = (v0 * 8.0 / 100.0)\n"
        "    t1 = (v1 / 1000.0)\n"
        "    return [t0, t1]\n"
    )


def test_a_value_is_converted_with_the_same_policies() -> None:
    a = Schema("a", {"x": length("m"), "y": length("m")})
    b = Schema("b", {"x": length("mm"), "z": length("m", default=3)})
    value = a(x=1, y=2)
    with pytest.raises(ConversionError, match="nothing gives 'z'"):
        value.to(b)
    assert value.to(b, missing="default") == {"x": 1000.0, "z": 3.0}
    with pytest.raises(ConversionError, match="'y' would be dropped"):
        value.to(b, missing="default", surplus="error")
    with pytest.raises(ConversionError, match="missing= is 'error' or 'default'"):
        value.to(b, missing="zero")


def test_payloads_convert_as_values_do() -> None:
    """Reading and converting are one function for payloads, and two for values."""
    a = Schema(
        "a",
        {
            "on": boolean(),
            "p": {"x": length("m"), "v": array(2, "m")},
            "n": integer(),
            "mode": choice("a", "b"),
        },
    )
    fixed, b = (
        a.slice("on", "p/**"),
        Schema("b", {"p": {"x": length("mm")}, "on": number()}),
    )
    for source in (a, fixed):
        value = source({"on": True, "p/x": 2})
        convert = source.converter(b)
        assert (
            convert.decode(value.encode())
            == convert(value)
            == {"p": {"x": 2e3}, "on": 1}
        )
        same = source.converter(source)
        assert same.decode(value.encode()) == same(value) == value
        # Other spellings of the same payload take the slow way to the same place.
        plain = value.to_wire_map()
        other = {key: plain[key] for key in reversed(plain)}
        packed = importlib.import_module("msgpack").packb(other)
        assert convert.decode(packed) == convert(value)

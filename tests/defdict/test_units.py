"""The unit table and the maps between units, held against unyt."""

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rems_net.defdict import (
    Field,
    Schema,
    angular_velocity,
    length,
    number,
    parse_quantity,
    temperature,
    velocity,
)
from rems_net.defdict.units.maps import Affine, unit_map
from rems_net.defdict.units.table import SHIFTED, TABLE as _TABLE
from rems_net.defdict.units.unit import Unit, find_unit
from rems_net.errors import FieldValueError, UnitError

COMPOUND = [
    "rad/s",
    "deg/s",
    "rpm",
    "rev/min",
    "m/s",
    "mm/s",
    "cm/ms",
    "km/hr",
    "m/s**2",
    "mm/s**2",
    "N*m",
    "mN*mm",
    "kg*m**2/s**2",
    "g*cm**2/ms**2",
    "rad/s**2",
    "deg/s**2",
    "1/s",
    "s**-1",
    "A*s",
    "mA*hr",
    "V/A",
    "kg*m**2",
    "W/kg",
]
unyt = pytest.importorskip("unyt")

# Units that only unyt knows; found there at first sight.
FOREIGN = [
    "mile",
    "lb",
    "lbf",
    "atm",
    "psi",
    "mile/hr",
    "arcmin",
    "degC",
    "degF",
    "day",
]
#: of another system in unyt, where it has another dimension
GAUSS = ("gauss", "G")
TABLE = [name for name in _TABLE if name not in GAUSS]
ALL = [*TABLE, *COMPOUND, *FOREIGN]


@pytest.mark.parametrize("name", [*TABLE, *COMPOUND])
def test_every_unit_of_the_table_is_what_unyt_says(name: str) -> None:
    ours, theirs = find_unit(name), unyt.Unit(name)
    assert ours.size is not None, "this one should come from the table"
    size = float(ours.size) * math.pi**ours.pi
    assert size == pytest.approx(float(theirs.base_value), rel=1e-15)
    assert theirs.base_offset == 0
    base = unyt.dimensions
    order = [base.length, base.mass, base.time, base.current_mks, base.temperature]
    product = 1
    for one, power in zip([*order, base.angle], ours.dimension, strict=True):
        product = product * one**power
    assert theirs.dimensions == product


@pytest.mark.parametrize("name", SHIFTED)
def test_a_zero_of_its_own(name: str) -> None:
    assert find_unit(name) == Unit(name, find_unit("K").dimension)
    expected = unyt.unyt_quantity(20.0, name).to_value("K")
    assert unit_map(name, "K")(20.0) == pytest.approx(float(expected), rel=1e-15)


@pytest.mark.parametrize("name", GAUSS)
def test_a_gauss_against_a_tesla(name: str) -> None:
    """unyt converts it, though its own gauss is of another system."""
    assert unit_map(name, "T")(1.0) == float(unyt.unyt_quantity(1.0, name).to("T"))
    assert parse_quantity(f"5 {name}", "mT") == 0.5
    assert parse_quantity(unyt.unyt_quantity(5.0, name), "mT") == 0.5


@pytest.mark.parametrize(
    ("written", "kept"),
    [
        ("km/h", "km/hr"),
        ("mA h", "mA*hr"),
        ("m s^-1", "m*s**-1"),
        ("m s**-2", "m*s**-2"),
        ("N m", "N*m"),
        ("kg m^2/s^2", "kg*m**2/s**2"),
        ("kg (m/s)^2", "kg*(m/s)**2"),
        ("m / s", "m / s"),
    ],
)
def test_how_people_write_units(written: str, kept: str) -> None:
    assert number(written).unit == kept
    assert find_unit(written).size is not None, "it comes from the table"
    assert parse_quantity(f"2 {written}", kept) == 2.0


def test_kilometres_an_hour() -> None:
    assert parse_quantity("36 km/h", "m/s") == 10.0
    assert Schema("car", {"v": velocity("km/h")})(v="10 m/s").v == 36.0


@pytest.mark.parametrize(
    ("field", "came", "asked"),
    [
        (length(range=(0.001, 1)), 100, ' Did you mean "100 mm"?'),
        (length(range=(0.001, 1)), 25.0, ' Did you mean "25 mm"?'),
        (length(range=(0.001, 1)), 5000, ""),
        (length(range=(0.001, 1)), 1.5, ""),
        (angular_velocity(range=(-8, 8)), -90, ' Did you mean "-90 deg/s"?'),
        (number("T", range=(0, 1e-3)), 50, ' Did you mean "50 uT"?'),
    ],
)
def test_what_is_far_out_of_range(field: Field, came: float, asked: str) -> None:
    with pytest.raises(FieldValueError) as caught:
        Schema("s", {"x": field})(x=came)
    assert str(caught.value).endswith(
        f"but got {came!r}.{asked} To limit it, use clip(). (R0101)"
    )


@given(st.sampled_from(ALL), st.sampled_from(ALL), st.floats(-1e6, 1e6))
def test_any_pair_agrees_with_unyt(a: str, b: str, x: float) -> None:
    quantity = unyt.unyt_quantity(x, a)
    if quantity.units.dimensions != unyt.Unit(b).dimensions:
        with pytest.raises(UnitError):
            unit_map(a, b)
        return
    expected = float(quantity.to_value(b))
    # degC and degF subtract large offsets, so there the zero point sets the scale.
    scale = max(abs(expected), 500.0 if "deg" in a + b and len(a) == 4 else 0.0)
    assert abs(unit_map(a, b)(x) - expected) <= 1e-12 * scale


@given(st.sampled_from(ALL), st.sampled_from(ALL), st.floats(-1e6, 1e6))
def test_the_printed_map_is_the_map(a: str, b: str, x: float) -> None:
    try:
        made = unit_map(a, b)
    except UnitError:
        return
    assert eval(made.code("x"), {"x": x}) == made(x)


def test_decimal_factors_do_not_round_for_nothing() -> None:
    assert unit_map("cm", "m")(7.0) == 0.07  # 7 * 0.01 would be 0.07000000000000001
    assert unit_map("mm", "m")(250.0) == 0.25
    assert unit_map("m", "mm") == Affine(mul=1000.0)
    assert unit_map("mm", "m") == Affine(div=1000.0)


def test_temperature_has_a_zero_point() -> None:
    assert unit_map("degC", "K")(25.0) == pytest.approx(298.15, rel=1e-15)
    cpu = Schema("cpu", {"t": temperature("degC", range=(-40, 120))})
    warm = cpu()
    warm.t = "104 degF"
    assert warm.t == pytest.approx(40.0, abs=1e-9)


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("sec", "s"),
        ("m/sec", "m/s"),
        ("rads/sec**2", "rad/s**2"),
        ("kmh", "km/h"),
        ("cms", "cm"),
        ("Degrees", "deg"),
        ("mmm", "mm"),
    ],
)
def test_what_people_say_is_understood(said: str, meant: str) -> None:
    """'sec' was taken for 'EC', and 'm/sec' for nothing."""
    with pytest.raises(UnitError) as caught:
        find_unit(said)
    assert str(caught.value).endswith(f"Did you mean {meant!r}? (R0103)")
    assert find_unit(meant)


def test_a_decimal_comma() -> None:
    point = Schema("point", {"x": length()})()
    with pytest.raises(FieldValueError, match=r'Write a decimal point: "0\.5 m"\.'):
        point.x = "0,5 m"


def test_a_quantity_takes_its_own_units_only() -> None:
    with pytest.raises(UnitError) as caught:
        length("s")
    assert str(caught.value) == (
        "length() takes a unit such as 'm'; 's' is a unit of time. (R0102)"
    )


def test_a_unit_registered_with_unyt_is_known() -> None:
    unyt.define_unit("pool_length", (50.0, "m"))
    bridge = Schema("bridge", {"span": number("pool_length")})
    value = bridge(span=3.5)
    metres = Schema("bridge", {"span": length("m")})
    assert value.to(metres).span == pytest.approx(3.5 * 50.0, rel=1e-12)
    value.span = "500 m"
    assert value.span == pytest.approx(10.0)


@pytest.mark.parametrize(
    "text",
    [
        "().__class__",
        "m.__class__",
        "9**9**9**9",
        "m**999",
        "__import__('os')",
        "m" * 99,
    ],
)
def test_text_that_is_no_unit_is_never_evaluated(text: str) -> None:
    with pytest.raises(UnitError):
        find_unit(text)


@pytest.mark.parametrize(
    ("given_value", "unit", "expected"),
    [
        ("0.1 s", "s", 0.1),
        ("100 ms", "s", 0.1),
        ("6.8 rad/s", "rad/s", 6.8),
        ("250 mm", "m", 0.25),
        ("250mm", "m", 0.25),
        ("180 deg", "rad", math.pi),
        ("-1e-3 m", "mm", -1.0),
        (".5 m", "m", 0.5),
        (2, "s", 2.0),
        (np.float32(0.5), "s", 0.5),
        (25 * unyt.cm, "m", 0.25),
    ],
)
def test_parse_quantity(given_value: object, unit: str, expected: float) -> None:
    found = parse_quantity(given_value, unit)
    assert type(found) is float
    assert found == expected


@pytest.mark.parametrize("bad", ["", "s", "0.1", "1 2 s", "0.1 m", None, True, [1]])
def test_parse_quantity_refuses(bad: object) -> None:
    with pytest.raises(FieldValueError, match=r"^--dt expects a number in s"):
        parse_quantity(bad, "s", "--dt")


def test_ordinary_units_do_not_import_unyt() -> None:
    code = """
import sys
import rems_net.defdict as d
s = d.Schema("s", {
    "x": d.length("m", range=("-500 mm", "500 mm")),
    "w": d.angular_velocity("rpm", range=(-80, 80)),
    "f": d.force("mN"),
    "p": d.percent(),
    "t": d.number("degC"),
})
v = s(x="250 mm", w="50 percent", f="0.1 N")
v.w = "90 deg/s"
t = d.Schema("t", {"x": d.length("inch"), "w": d.angular_velocity("rad/s")})
v.to(t)
d.parse_quantity("0.1 s", "s")
try:
    v.x = "2 s"
except d.parse_quantity.__globals__["UnitError"]:
    pass
d.Schema.from_wire(s.to_wire()).decode(v.encode())
print(str(v), repr(v), v.describe())
bad = {"unyt", "pint", "sympy", "zenoh", "rich"} & set(sys.modules)
assert not bad, bad
"""
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)

"""What may come from anybody: units, names and numbers that mean harm."""

import importlib
from collections.abc import Callable
from typing import Any, cast

import pytest

from rems_net.defdict import (
    Field,
    Schema,
    boolean,
    choice,
    count,
    length,
    number,
    percent,
    rule,
    text,
)
from rems_net.defdict.units.maps import unit_map
from rems_net.defdict.units.unit import MAX_TEXT, find_unit
from rems_net.errors import ConversionError, SchemaError, UnitError, WireError

pack: Callable[[Any], bytes] = importlib.import_module("msgpack").packb


def described(**field: Any) -> bytes:
    """The description of a schema of one field, as anybody could send it."""
    row = [
        field.pop("path", "x"),
        field.pop("dtype", "float"),
        {key: value for key, value in field.items() if key != "name"},
    ]
    return pack({"rems": 1, "name": field.get("name", "s"), "fields": [row]})


def test_the_description_is_good() -> None:
    assert Schema.from_wire(described(unit="m")) == Schema("s", {"x": length()})


# -- units --------------------------------------------------------------------

CHAINS = [
    "m**9**9**9",
    "m**(9)**9",
    "(m**9)**9",
    "((m**9)**9)**9",
    "m**13",
    "m**99",
    "(m*s**7)**2",
    "m**(9**9)",
    "m**9.**9",
    "1**9**9**9",
    "m*9**9",
    "m(9)",
    "m 2",
    "m*",
    "*m",
    "(m",
    "m)",
    "()",
    "m//s",
    "m**",
    "m**(1/0)",
    "m\n*s",
]


@pytest.mark.parametrize("unit", CHAINS)
def test_one_small_power_for_each_name(unit: str) -> None:
    with pytest.raises(UnitError, match="is not written like a unit"):
        find_unit(unit)
    with pytest.raises(WireError):
        Schema.from_wire(described(unit=unit))
    with pytest.raises(WireError):
        Schema.from_wire(described(dtype="int", unit="count", means=unit))


@pytest.mark.parametrize(
    ("unit", "same"),
    [
        ("(m/s)**2", "m**2/s**2"),
        ("m/(s*s)", "m/s**2"),
        ("1/(s/m)", "m/s"),
        ("kg*(m/s)**2/m", "N"),
        ("(N*m)", "N*m"),
        ("m**(2)", "m**2"),
        ("m**( 2 )", "m**2"),
        ("m ** 2", "m**2"),
        ("m**4 / m**2", "m**2"),
    ],
)
def test_parentheses_and_powers_are_units(unit: str, same: str) -> None:
    assert find_unit(unit).dimension == find_unit(same).dimension
    assert unit_map(unit, same)(3.0) == pytest.approx(3.0, rel=1e-15)


@pytest.mark.parametrize("unit", ["m**(1/2)", "m**0.5", "m**.5", "(m/s)**(-1/2)"])
def test_roots_are_units(unit: str) -> None:
    assert "length" in find_unit(unit).measures


@pytest.mark.parametrize(
    "unit", ["ns**8*" * 8000 + "s", "m" * (MAX_TEXT + 1), " " * 10**6, "(" * 65]
)
def test_a_long_text_is_not_looked_at(unit: str) -> None:
    for look in (find_unit, number, lambda one: Field("float", means=one)):
        with pytest.raises(UnitError, match="is not written like a unit") as caught:
            look(unit)
        assert len(str(caught.value)) < 200
    schema = Schema("s", {"x": length()})
    with pytest.raises(ValueError, match=r"^s: 'x' expects a number in m"):
        schema(x=f"1 {unit}x")


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("*".join(["km**8"] * 10), "*".join(["um**8"] * 10)),
        ("*".join(["um**8"] * 10), "*".join(["km**8"] * 10)),
        ("*".join(["mile**12"] * 6), "*".join(["nm**12"] * 6)),
    ],
)
def test_factors_beyond_any_float_are_refused(one: str, other: str) -> None:
    with pytest.raises(UnitError, match="too large or too small a factor"):
        unit_map(one, other)
    a, b = (Schema("s", {"x": number(unit)}) for unit in (one, other))
    with pytest.raises(ConversionError):
        a.converter(b)


# -- numbers ------------------------------------------------------------------


def test_a_range_has_a_finite_span() -> None:
    wide = (-1.7e308, 1.6e308)
    with pytest.raises(SchemaError, match="a range spans less than"):
        length(range=wide)
    with pytest.raises(SchemaError, match="a range spans less than"):
        percent(range=wide)
    with pytest.raises(WireError, match="a range spans less than"):
        Schema.from_wire(described(range=list(wide)))
    half = Schema("s", {"x": length(range=(-8e305, 8e305))})
    shares = Schema("s", {"x": percent()})
    assert shares(x=50).to(half).x == 4e305


@pytest.mark.parametrize(
    "table",
    [
        [["0", "1"], ["1", "2"]],
        [[0, "1"], [1, "2"]],
        [[True, 0], [2, 1]],
        [[0, -1.7e308], [1, 1.7e308]],
        [[-1.7e308, 0], [1.7e308, 1]],
    ],
)
def test_a_table_is_of_numbers(table: Any) -> None:
    with pytest.raises(SchemaError, match="a table is pairs"):
        count(table=table, means="m")
    with pytest.raises(WireError, match="a table is pairs"):
        Schema.from_wire(
            described(dtype="int", unit="count", means="m", table=table),
        )


def test_a_table_of_huge_integers_is_refused() -> None:
    with pytest.raises(SchemaError, match="a table is pairs"):
        count(table=[(0, 0), (10**400, 1)], means="m")
    with pytest.raises(SchemaError, match="max_age is a time"):
        length(max_age=10**400)


@pytest.mark.parametrize("max_len", [True, False, 1.0, "8", 0, 2**40])
def test_max_len_is_a_whole_number(max_len: Any) -> None:
    with pytest.raises(WireError):
        Schema.from_wire(described(dtype="str", max_len=max_len))


def test_max_len_true_is_refused_here_too() -> None:
    with pytest.raises(SchemaError, match="max_len is 1 to"):
        text(max_len=True)


# -- names --------------------------------------------------------------------

HARMFUL = ["\0", "a\nb", "a\x1b[31m", "\x9b31m", "a\x7f", "\u202egnp", "a\u2028b"]


@pytest.mark.parametrize("name", HARMFUL)
def test_names_are_printable(name: str) -> None:
    with pytest.raises(SchemaError, match="the name of a schema is printable"):
        Schema(name, {"x": length()})
    with pytest.raises(SchemaError, match="is not a field name"):
        Schema("s", {name: length()})
    with pytest.raises(SchemaError, match="are printable"):
        choice("good", name)
    for sent in (
        described(name=name),
        described(path=name),
        described(dtype="choice", choices=["good", name]),
    ):
        with pytest.raises(WireError) as caught:
            Schema.from_wire(sent)
        assert str(caught.value).isprintable()


@pytest.mark.parametrize("doc", [*HARMFUL, "two\nlines"])
def test_a_doc_prints_in_its_line(doc: str) -> None:
    schema = Schema.from_wire(described(doc=doc))
    shown = str(schema).splitlines()
    assert len(shown) == 3
    assert all(line.isprintable() for line in shown)
    assert cast("Field", schema["x"]).doc == doc


def test_the_name_of_a_rule_is_no_code() -> None:
    name = "evil\n    raise SystemExit('ran')\n    #"

    switch, lamp = Schema("a", {"on": boolean()}), Schema("b", {"x": length()})

    @rule(switch, lamp, name=name)
    def light(value: Any) -> dict[str, float]:
        return {"x": float(value.on)}

    convert = switch.converter(lamp, [light])
    assert convert({"on": True}).x == 1.0
    assert convert.decode(switch(on=True).encode()).x == 1.0
    assert repr(name) in convert.code

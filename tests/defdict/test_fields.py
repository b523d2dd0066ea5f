"""What each kind of field takes, stores and refuses."""

import pydoc
from functools import partial
from typing import Any, cast

import numpy as np
import pytest

from rems_net.defdict import (
    Field,
    Schema,
    angular_velocity,
    array,
    blob,
    boolean,
    choice,
    count,
    integer,
    length,
    many,
    number,
    percent,
    ratio,
    text,
    torque,
)
from rems_net.defdict.fields.makers import measure
from rems_net.errors import FieldValueError, RemsError, SchemaError, UnitError

unyt = pytest.importorskip("unyt")

ALL = Schema(
    "all",
    {
        "x": length("m", range=(-2, 2), default=0.5),
        "n": integer(range=(0, 10)),
        "on": boolean(default=True),
        "name": text(max_len=8),
        "raw": blob(max_len=4),
        "mode": choice("euler", "rk4"),
        "scan": array(3, "m", range=(0, 4)),
        "map": array((2, 2), dtype="u1"),
        "free": number(),
    },
)


def test_defaults() -> None:
    value = ALL()
    assert value.x == 0.5
    assert value.n == 0
    assert value.on is True
    assert value["name"] == ""
    assert value.raw == b""
    assert value.mode == "euler"
    assert value.scan.tolist() == [0, 0, 0]
    assert value["map"].dtype == np.uint8
    assert Schema("s", {"x": length(range=(1, 2))})().x == 1.0


@pytest.mark.parametrize(
    ("path", "given", "stored"),
    [
        ("x", 1, 1.0),
        ("x", 1.5, 1.5),
        ("x", np.float32(1.5), 1.5),
        ("x", np.int64(1), 1.0),
        ("x", "25 cm", 0.25),
        ("x", 25 * unyt.cm, 0.25),
        ("x", unyt.cm, 0.01),
        ("x", "50 percent", 1.0),
        ("x", -50 * unyt.percent, -1.0),
        ("n", 3, 3),
        ("n", np.int64(3), 3),
        ("on", False, False),
        ("on", np.bool_(False), False),
        ("name", "ab", "ab"),
        ("raw", bytearray(b"ab"), b"ab"),
        ("mode", "rk4", "rk4"),
        ("free", -1e308, -1e308),
    ],
)
def test_accepts(path: str, given: Any, stored: Any) -> None:
    value = ALL()
    value[path] = given
    assert value[path] == stored
    assert type(value[path]) is type(stored)
    value.encode()


@pytest.mark.parametrize(
    ("path", "given"),
    [
        ("x", "hello"),
        ("x", "1"),
        ("x", "2 s"),
        ("x", 2 * unyt.s),
        ("x", [1.0]),
        ("x", [1.0] * unyt.m),
        ("x", True),
        ("x", None),
        ("x", 1j),
        ("x", 2.1),
        ("x", float("nan")),
        ("x", float("inf")),
        ("x", 10**400),
        ("x", np.float64("nan")),
        ("x", float("nan") * unyt.cm),
        ("n", 10**400),
        ("n", 3.0),
        ("n", True),
        ("n", 11),
        ("n", "3"),
        ("n", float("nan")),
        ("n", float("nan") * unyt.dimensionless),
        ("on", 1),
        ("on", "yes"),
        ("name", "too long, this"),
        ("name", "äöüßé"),
        ("name", "\ud800"),
        ("name", b"ab"),
        ("raw", b"12345"),
        ("raw", "ab"),
        ("mode", "heun"),
        ("mode", 0),
        ("scan", [1, 2]),
        ("scan", [1, 2, 3, 4]),
        ("scan", [[1, 2, 3]]),
        ("scan", [1, 2, 5]),
        ("scan", [1, 2, float("nan")]),
        ("scan", [True, False, True]),
        ("scan", ["1", "2", "3"]),
        ("scan", "3 m"),
        ("scan", [1, 2, [3]]),
        ("scan", [1, 2, 3] * unyt.s),
        ("map", [[1, 2], [3, 256]]),
        ("map", [[1, 2], [3, -1]]),
        ("map", [[1.0, 2], [3, 4]]),
    ],
)
def test_refuses_and_keeps_what_it_had(path: str, given: Any) -> None:
    value = ALL()
    before = value.to_dict()
    with pytest.raises(FieldValueError, match=rf"^all: '{path}'"):
        value[path] = given
    assert value == before


def test_arrays_are_copied_little_endian_and_read_only() -> None:
    value, mine = ALL(), np.array([1.0, 2.0, 3.0], dtype=">f8")
    value.scan = mine
    mine[0] = 9
    assert value.scan.tolist() == [1, 2, 3]
    assert value.encode().endswith(b"\x00" * 8)
    with pytest.raises(ValueError, match="read-only"):
        value.scan[0] = 1.0
    value.scan = [100, 200, 300] * unyt.cm
    assert value.scan.tolist() == [1, 2, 3]


def test_lists_of_schemas() -> None:
    spot = Schema("spot", {"x": length("m"), "id": integer()})
    seen = Schema("seen", {"spots": many(spot, max_len=2), "t": number()})
    value = seen({"spots": [{"x": 1, "id": 7}, spot(x=2)]})
    assert [one.x for one in value.spots] == [1.0, 2.0]
    copy = value.copy()
    value.spots[0].x = "5 m"
    assert copy.spots[0].x == 1.0
    assert seen.decode(value.encode()) == value
    assert value != copy
    with pytest.raises(FieldValueError, match=r"at most 2 spot.*It has 3 items"):
        value.spots = [{}, {}, {}]
    with pytest.raises(RemsError, match=r"seen: 'spots'\[1\]: spot: 'x' expects"):
        value.spots = [{}, {"x": "far"}]
    with pytest.raises(FieldValueError):
        value.spots = {"x": 1}


def test_one_line_specialises_a_quantity() -> None:
    wheel = partial(angular_velocity, "rad/s", range=(-6.8, 6.8))
    assert wheel(doc="left").range == (-6.8, 6.8)
    jerk = measure("acceleration", "m/s**2")
    assert jerk("mm/s**2").unit == "mm/s**2"
    assert torque().unit == "N*m"
    assert percent().range == (-100, 100)
    assert ratio().range == (-1, 1)
    assert length("mm", range=("1 cm", 2 * unyt.cm)).range == (10, 20)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: length(range=(2, 1)), "from low to high"),
        (lambda: length(range=cast("Any", 3)), "a range is a pair"),
        (lambda: length(range=(0, float("nan"))), "a range's end expects a number"),
        (lambda: length(range=(0, 1), default=2), "the default expects a number"),
        (lambda: integer(range=(0, 1.5)), "whole"),
        (lambda: integer(range=(0, 2**64)), "goes beyond"),
        (lambda: array(3, dtype="u1", range=(0, 300)), "u1 holds 0 to 255"),
        (lambda: array(3, dtype="f4", range=(0, 1e39)), "goes beyond"),
        (lambda: choice(), "one or more different names"),
        (lambda: choice("a", "a"), "one or more different names"),
        (lambda: array((0,)), "from 1 up"),
        (lambda: array(10**9), "is beyond"),
        (lambda: array(3, dtype="f16"), "is not one of"),
        (lambda: length(max_age=0), "max_age"),
        (lambda: count(means="m"), "needs table= or functions="),
        (lambda: count(table=[(0, 1)], means="m"), "at least two"),
        (lambda: count(table=[(0, 1), (1, 3), (2, 2)], means="m"), "rise all the way"),
        (lambda: count(table=[(0, 1), (0, 3)], means="m"), "each count once"),
        (lambda: text(max_len=0), "max_len"),
        (lambda: Field("str", range=(0, 1)), "has no range"),
        (lambda: Field("list"), "needs the schema"),
    ],
)
def test_a_field_checks_itself(make: Any, says: str) -> None:
    with pytest.raises((SchemaError, FieldValueError, UnitError), match=says):
        make()


def test_fields_are_frozen_values() -> None:
    assert length("m", range=(0, 1)) == length("m", range=(0, 1))
    with pytest.raises(AttributeError):
        cast("Any", length("m")).unit = "mm"
    assert length(" m ").unit == "m"
    assert number("m/s^2").unit == "m/s**2"


def test_whole_ranges_are_exact() -> None:
    assert integer(range=(0, 2**53 + 1)).range == (0, 2**53 + 1)


def test_a_dtype_is_for_arrays() -> None:
    with pytest.raises(SchemaError, match=r"length\(dtype='f4'\) .* give shape="):
        length(dtype="f4")
    assert length(shape=3, dtype="f4").dtype == "f4"
    assert length(shape=3) == array(3, "m")


def test_makers_share_equal_fields_and_keep_others_apart() -> None:
    assert length("m", range=(0, 1)) is length("m", range=(0, 1))
    assert integer(default=1) is integer(default=1)
    below, above = number(default=-0.0), number(default=0.0)
    assert np.signbit([below.default, above.default]).tolist() == [True, False]
    assert integer(range=(0, 1)).range == (0, 1)
    with pytest.raises(FieldValueError):
        number(default=cast("Any", True))
    assert number(default=1).default == 1.0
    span = [1, 2]
    fields = [length(range=cast("Any", span)) for span[0] in (0, 1)]
    assert [field.range for field in fields] == [(0, 2), (1, 2)]


def test_help_shows_the_arguments() -> None:
    shown = pydoc.plain(pydoc.render_doc(length))
    # A line for each since Python 3.13.
    together = " ".join(shown.split()).replace("( ", "(")
    assert "length(unit: str = 'm', *, range: " in together
    assert "Make a field that holds length, by default in m." in shown


def test_an_array_of_texts_with_units() -> None:
    box = Schema("box", {"size": array(2, "m", range=(0, 9))})
    assert box({"size": ["250 cm", 1]})["size"].tolist() == [2.5, 1.0]
    with pytest.raises(FieldValueError, match=r"from 0 to 9, but got '20 m'"):
        box({"size": ["20 m", "1 m"]})


def test_arrays_make_fields_equal_or_not() -> None:
    assert array(2, default=[1, 2]) == array(2, default=[1, 2])
    assert array(2, default=[1, 2]) != array(2, default=[1, 3])
    assert length() != "length"
    assert len({array(2, default=[1, 2]), array(2, default=[1, 2]), length()}) == 2
    assert length(doc="a") != length(doc="b")

"""What a schema is made of, and what is none: in Python, and as it came."""

import math
from typing import Any, cast

import pytest

from rems_net.defdict import DefDict, Schema, choice, length, velocity
from rems_net.errors import FieldValueError, SchemaError, WireError
from tests.defdict.test_payloads import packed


def test_schemas_nest_by_path_dict_or_schema() -> None:
    side = Schema("side", {"v": velocity()})
    a = Schema("s", {"l": {"v": velocity()}, "r": side})
    b = Schema("s", {"l/v": velocity(), "r/v": velocity()})
    assert a == b
    assert a.digest == b.digest


@pytest.mark.parametrize(
    ("entries", "says"),
    [
        ({"a b": length()}, "is not a field name"),
        ({"@a": length()}, "is not a field name"),
        ({"a*": length()}, "is not a field name"),
        ({"": length()}, "is not a field name"),
        ({"a//b": length()}, "is not a field name"),
        ({"x" * 65: length()}, "is not a field name"),
        ({1: length()}, "field names are text"),
        ({"a": 1.0}, "must be a field such as length"),
        ({"a": length}, "must be a field such as length"),
        ({"a": {}}, "group without fields"),
        ({"a": length(), "a/b": length()}, "lies inside a field"),
        ({"a/b": length(), "a": length()}, "twice"),
        ({"a": {"b": length()}, "a/b": length()}, "twice"),
        ([1], "must be a field"),
        ({"/".join("abcdefghijklmnopqrs"): length()}, "deep"),
    ],
)
def test_schemas_refuse(entries: Any, says: str) -> None:
    with pytest.raises(SchemaError, match=says):
        Schema("bad", entries)


def test_a_schema_has_a_name_first() -> None:
    with pytest.raises(SchemaError, match="begins with its name"):
        Schema(cast("Any", {"x": length()}))


def test_choice_and_empty_schema() -> None:
    assert Schema("none", {})() == {}
    assert Schema("none").decode(b"\x80") == {}
    mode = Schema("m", {"mode": choice("a", "b")})
    assert mode(mode="b").mode == "b"


def test_a_schema_refuses_a_bad_unit_at_once() -> None:
    with pytest.raises(SchemaError, match="has no unit"):
        type(length("m"))("str", "m")


def test_defdict_is_only_made_by_schemas() -> None:
    with pytest.raises(FieldValueError, match="made by its schema"):
        DefDict({"x": 1})


GOOD = {"rems": 1, "name": "s", "fields": [["x", "float", {"unit": "m"}]]}


def test_the_good_one_is_good() -> None:
    assert Schema.from_wire(packed(GOOD)).paths == ("x",)


@pytest.mark.parametrize(
    "found",
    [
        None,
        [],
        {},
        {**GOOD, "rems": 2},
        {**GOOD, "rems": True},
        {**GOOD, "more": 1},
        {**GOOD, "name": 3},
        {**GOOD, "name": ""},
        {**GOOD, "fields": {}},
        {**GOOD, "fields": [["x"]]},
        {**GOOD, "fields": [["x", "float", []]]},
        {**GOOD, "fields": [["x", "float", {}], ["x", "float", {}]]},
        {**GOOD, "fields": [[["x"], "float", {}]]},
        {**GOOD, "fields": [["x y", "float", {}]]},
        {**GOOD, "fields": [["x", "object", {}]]},
        {**GOOD, "fields": [["x", "O", {"shape": [1]}]]},
        {**GOOD, "fields": [["x", "f8", {"shape": [10**9]}]]},
        {**GOOD, "fields": [["x", "f8", {"shape": [2], "default": b"123"}]]},
        {**GOOD, "fields": [["x", "f8", {"shape": ["a"]}]]},
        {**GOOD, "fields": [["x", "float", {"functions": True}]]},
        {**GOOD, "fields": [["x", "float", {"unit": "bananas"}]]},
        {**GOOD, "fields": [["x", "float", {"unit": "9**9**9**9"}]]},
        {**GOOD, "fields": [["x", "float", {"unit": "m" * 100}]]},
        {**GOOD, "fields": [["x", "float", {"range": [1]}]]},
        {**GOOD, "fields": [["x", "float", {"range": ["1 m", "2 m"]}]]},
        {**GOOD, "fields": [["x", "float", {"default": "1 m", "unit": "m"}]]},
        {**GOOD, "fields": [["x", "float", {"default": math.nan}]]},
        {**GOOD, "fields": [["x", "int", {"default": 2**64 - 1}]]},
        {**GOOD, "fields": [["x", "choice", {"choices": [1]}]]},
        {**GOOD, "fields": [["x", "list", {}]]},
        {**GOOD, "fields": [["x", "list", {"item": GOOD, "max_len": 2**40}]]},
        {**GOOD, "fields": [["x", "int", {"table": [[1, 2], [1]]}]]},
    ],
)
def test_a_description_that_is_none(found: Any) -> None:
    with pytest.raises(WireError):
        Schema.from_wire(packed(found))


def test_descriptions_are_bounded() -> None:
    with pytest.raises(WireError, match="is over"):
        Schema.from_wire(b"\x00" * (2 << 20))
    nested: Any = GOOD
    for _ in range(8):
        nested = {**GOOD, "fields": [["x", "list", {"item": nested, "max_len": 2}]]}
    with pytest.raises(WireError):
        Schema.from_wire(packed(nested))
    for payload in (b"\xdd\xff\xff\xff\xff" * 100, b"\x91" * 5000, b"\x81" * 5000):
        with pytest.raises(WireError):
            Schema.from_wire(payload)

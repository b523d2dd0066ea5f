"""A DefDict is a mapping with fixed keys, with attributes, paths, globs and arrays."""

import copy
import pickle
from collections.abc import MutableMapping
from typing import Any

import pytest

from rems_net.defdict import (
    DefDict,
    Schema,
    boolean,
    count,
    integer,
    length,
    percent,
    ratio,
    text,
    velocity,
)
from rems_net.errors import (
    FieldValueError,
    FixedKeysError,
    SchemaError,
    UnitError,
    UnknownFieldError,
)
from tests.defdict.conftest import ROBOT, wheel

unyt = pytest.importorskip("unyt")


def test_it_is_a_mutable_mapping_with_fixed_keys(value: DefDict) -> None:
    assert isinstance(value, MutableMapping)
    assert list(value) == ["x", "wheel", "arm", "tags"]
    assert list(value.keys()) == list(value)
    assert len(value) == 4
    assert dict(value.items())["x"] == 2.0
    assert next(iter(value.values())) == 2.0
    assert value.get("x") == 2.0
    assert value.get("nope", 7) == 7
    assert value.setdefault("x", 9) == 2.0
    assert {**value}["x"] == 2.0
    assert list(value)[-1] == "tags"
    match value:
        case {"x": x, "wheel": {"left": {"velocity": v}}}:
            assert (x, v) == (2.0, 1.0)
        case _:
            pytest.fail("a DefDict matches as a mapping")


@pytest.mark.parametrize("key", ["x", "wheel", "wheel/left", "wheel/left/velocity"])
def test_contains_names_and_paths(value: DefDict, key: str) -> None:
    assert key in value
    value[key]


@pytest.mark.parametrize("key", ["", "y", "wheel/", "/x", "wheel/left/x", 1, None, ()])
def test_does_not_contain(value: DefDict, key: Any) -> None:
    assert key not in value
    with pytest.raises(UnknownFieldError):
        value[key]
    with pytest.raises(KeyError):
        value[key] = 1.0


def test_keys_cannot_be_removed_or_added(value: DefDict) -> None:
    with pytest.raises(FixedKeysError, match="keys of robot are fixed"):
        value.pop("x")
    with pytest.raises(FixedKeysError):
        value.popitem()
    with pytest.raises(FixedKeysError):
        value.clear()
    with pytest.raises(FixedKeysError):
        del value["x"]
    with pytest.raises(UnknownFieldError):
        value.update(y=1)
    with pytest.raises(UnknownFieldError):
        value | {"y": 1}
    with pytest.raises(UnknownFieldError):
        value.setdefault("y", 1)


def test_equality(value: DefDict) -> None:
    other = value.copy()
    assert value == other
    other.x = 3.0
    assert (value == other) is False  # the ancestor answered [False, True]
    assert value != other
    assert value == value.to_dict()
    assert value != {"x": 2.0}
    assert value.wheel.left == {"velocity": 1.0, "on": False}
    assert value != 5
    assert value.wheel.left != value.wheel.right
    metre, mile = (Schema("s", {"x": length(unit)})(x=1) for unit in ("m", "mile"))
    assert metre != mile
    assert Schema("other", {"x": length("m", default=3)})(x=1) == metre
    with pytest.raises(TypeError, match="unhashable"):
        hash(value)


def test_order_does_not_matter_for_equality() -> None:
    one = Schema("s", {"a": length(), "b": length()})(a=1, b=2)
    two = Schema("s", {"b": length(), "a": length()})(a=1, b=2)
    assert one == two
    assert one.schema.digest == two.schema.digest
    assert one.schema != two.schema
    assert one.schema.decode(two.encode()) == one


def test_or_makes_a_new_one(value: DefDict) -> None:
    other = value | {"x": "50 cm"}
    assert (value.x, other.x) == (2.0, 0.5)
    other |= {"x": 1, "tags": 3}
    assert (other.x, other.tags) == (1.0, 3)
    assert isinstance(other, DefDict)
    with pytest.raises(TypeError):
        value | 3


def test_numbers_of_another_unit_are_not_taken_as_they_are() -> None:
    metre, inch = (Schema(u, {"p": {"x": length(u)}}) for u in ("m", "inch"))
    near = metre({"p/x": 1})
    for take in (
        lambda: inch(near),
        lambda: inch().update(near),
        lambda: inch().__setitem__("p", near.p),
        lambda: inch() | near,
    ):
        with pytest.raises(UnitError) as caught:
            take()
        found = str(caught.value).replace("m/p.", "m.")  # the group, or the whole
        assert found == (
            "inch: 'p/x' is in inch, but in m in m. Convert it first: value.to(...). "
            "(R0102)"
        )
    assert inch(near.to(inch)) == near.to(inch)
    assert metre(near) == near
    assert {"p": 1, "q": 2} | near == {"p": {"x": 1.0}, "q": 2}
    assert list(reversed(near)) == ["p"]


def test_update_sets_all_or_nothing(value: DefDict) -> None:
    before = value.to_dict()
    with pytest.raises(FieldValueError):
        value.update({"x": 5, "wheel/left/velocity": 99})
    assert value == before
    value.update([("x", 5)], tags=2)
    assert (value.x, value.tags) == (5.0, 2)


def test_copies_share_nothing(value: DefDict) -> None:
    for made in (value.copy(), copy.copy(value), copy.deepcopy(value)):
        made.wheel.left.velocity = 7.0
        assert value.wheel.left.velocity == 1.0
    group = value.wheel.copy()
    group.left.velocity = 3.0
    assert value.wheel.left.velocity == 1.0
    assert group.schema.paths[0] == "left/velocity"


def test_pickle_is_refused_and_says_what_to_do(value: DefDict) -> None:
    with pytest.raises(TypeError, match=r"send payload = value.encode\(\)"):
        pickle.dumps(value)
    assert pickle.loads(pickle.dumps(ROBOT)) == ROBOT


def test_attributes(value: DefDict) -> None:
    value.wheel.left.velocity = 3
    assert value["wheel/left/velocity"] == 3.0
    assert value["wheel"].left["velocity"] == 3.0
    with pytest.raises(UnknownFieldError, match=r"no field 'wheels'. Did you mean"):
        _ = value.wheels
    with pytest.raises(AttributeError, match="Did you mean 'x'"):
        value.X = 1.0
    with pytest.raises(UnknownFieldError, match="'wheel/left/velocty'"):
        value.wheel.left.velocty = 1.0
    assert not hasattr(value, "nothing_like_it")


def test_a_field_may_be_called_like_a_method() -> None:
    hidden = Schema("hidden", {"_schema": length(), "_leaves": length()})
    assert hidden({"_schema": 1}).copy()["_schema"] == 1.0
    schema = Schema("odd", {"set": length(), "copy": length(), "items": text()})
    value: Any = schema({"set": 1, "copy": 2, "items": "a"})
    assert callable(value.copy)
    assert value.copy()["copy"] == 2.0
    assert value.set == 1.0
    assert dict(value.items()) == {"set": 1.0, "copy": 2.0, "items": "a"}
    value["copy"] = 3.0
    for given in (4.0, 4, "4 m"):
        with pytest.raises(AttributeError) as caught:
            value.copy = given
        assert str(caught.value) == (
            "odd: 'copy' has the name of a method of every DefDict. "
            "Write value['copy'] = ... (R0105)"
        )
    assert value["copy"] == 3.0


def test_build_from_lists_of_the_right_length_only() -> None:
    pose = Schema("pose", {"x": length(), "y": length()})
    assert pose([1, 2]) == {"x": 1.0, "y": 2.0}
    for wrong in ([], [1], [1, 2, 3], "12", 5):
        with pytest.raises(FieldValueError):
            pose(wrong)


def test_arrays() -> None:
    pose = Schema("pose", {"p": {"x": length(), "y": length()}, "ok": boolean()})
    value = pose([1, 2, True])
    assert value.to_array().tolist() == [1.0, 2.0, 1.0]
    assert value.to_array(column=True).shape == (3, 1)
    other = pose()
    other.from_array(value.to_array(column=True))
    assert other == value
    other.from_array([3, 4, 0])
    assert other.p.to_array().tolist() == [3, 4]
    assert other.ok is False
    for wrong in ([1, 2], [[1, 2, 3]], [1, 2, 3, 4], 5):
        with pytest.raises(FieldValueError, match=r"\(3,\) or \(3, 1\)"):
            other.from_array(wrong)
    with pytest.raises(FieldValueError, match="'ok'"):
        other.from_array([1, 2, 0.5])
    named = Schema("named", {"n": text()})
    with pytest.raises(FieldValueError, match="'n' is str, not a number"):
        named().to_array()


def test_clip_limits_and_returns_what_was_kept(value: DefDict) -> None:
    kept = value.clip({"wheel/left/velocity": 99, "x": 5})
    assert kept == {"wheel/left/velocity": 8.0, "x": 5.0}
    assert value.wheel.left.velocity == 8.0
    assert value.clip({"wheel": {"left": {"velocity": -9}}}) == {
        "wheel/left/velocity": -8.0
    }
    assert value.clip({"wheel/*/velocity": -9})["wheel/right/velocity"] == -8.0
    assert value.wheel.clip({"left/velocity": 9}) == {"left/velocity": 8.0}
    assert value.clip(tags=3) == {"tags": 3}
    value.clip({"wheel/left/velocity": "1000 rpm"})
    assert value.wheel.left.velocity == 8.0
    value.clip({"wheel/left/velocity": float("inf"), "tags": 10**30})
    assert value.tags == 2**63 - 1
    for bad in (float("nan"), "hello", "", "2 s", True):
        with pytest.raises(FieldValueError, match="'wheel/left/velocity'"):
            value.clip({"wheel/left/velocity": bad})
    with pytest.raises(UnknownFieldError):
        value.clip(wheels=1)
    with pytest.raises(UnknownFieldError):
        value.clip({"wheels/*": 1})
    with pytest.raises(UnknownFieldError, match="is a group"):
        value.clip(wheel=1)


def test_quantities() -> None:
    state = Schema("s", {"v": velocity("m/s"), "n": integer(), "p": {"m": text()}})
    value = state(v=2)
    assert value.quantity("v") == 200 * unyt.cm / unyt.s
    assert str(value.quantity("v").units) == "m/s"
    shares = Schema("s", {"p": percent(), "r": ratio(), "c": count(range=(0, 10))})
    value2 = shares(p="50 %", r="50 percent", c="50 percent")
    assert value2 == {"p": 50.0, "r": 0.5, "c": 5}
    for path in value2:
        value2[path] = value2.quantity(path)
    assert value2 == {"p": 50.0, "r": 0.5, "c": 5}
    with pytest.raises(UnknownFieldError, match="is a group"):
        value.quantity("p")
    with pytest.raises(UnknownFieldError):
        value.quantity("w")


def test_printing_shows_units(value: DefDict) -> None:
    assert repr(value.wheel.left) == ("robot/wheel/left(velocity=1.0 rad/s, on=False)")
    assert "  wheel/left/velocity      1.0 rad/s\n" in str(value)
    assert value.describe()["wheel/left/velocity"] == {"value": 1.0, "unit": "rad/s"}
    assert "wheel/left/velocity      float  rad/s  -8 to 8  0.0" in str(ROBOT)


def test_schema_is_frozen_and_readable() -> None:
    assert ROBOT["wheel/left/velocity"] == wheel()["velocity"]
    assert getattr(ROBOT["wheel/left/velocity"], "unit", None) == "rad/s"
    assert isinstance(ROBOT["wheel"], Schema)
    assert "wheel/left" in ROBOT
    assert list(ROBOT) == ["x", "wheel", "arm", "tags"]
    assert ROBOT.paths[:2] == ("x", "wheel/left/velocity")
    with pytest.raises(SchemaError, match="frozen"):
        ROBOT.name = "other"
    with pytest.raises(UnknownFieldError, match=r"Did you mean 'wheel/left/velocity'"):
        ROBOT["wheel/left/velocities"]
    assert {ROBOT: 1}[pickle.loads(pickle.dumps(ROBOT))] == 1

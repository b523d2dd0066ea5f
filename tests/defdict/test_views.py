"""Groups and globs are live views of a value."""

from collections.abc import Mapping

import numpy as np
import pytest

from rems_net.defdict import DefDict
from rems_net.errors import FieldValueError, FixedKeysError, UnknownFieldError
from tests.defdict.conftest import ROBOT

unyt = pytest.importorskip("unyt")


def test_groups_are_live_views(value: DefDict) -> None:
    left = value["wheel/left"]
    left["velocity"] = 5.0
    assert value.wheel.left.velocity == 5.0
    value.wheel.left = {"velocity": "60 rpm", "on": True}
    assert left.velocity == pytest.approx(2 * np.pi)
    assert left.on is True
    value.wheel.right = left
    assert value.wheel.right == left
    left.velocity = 0.0
    assert value.wheel.right.velocity != 0.0
    assert left.encode() == left.schema.encode({"velocity": 0.0, "on": True})


def test_a_group_is_set_as_by_paths(value: DefDict) -> None:
    value["wheel/left/on"] = True
    value.wheel.left = {"velocity": 1}
    assert value.wheel.left == {"velocity": 1.0, "on": True}
    with pytest.raises(UnknownFieldError, match="'wheel/left/of'"):
        value.wheel.left = {"velocity": 5, "of": False}
    with pytest.raises(FieldValueError, match="'wheel/left/on'"):
        value["wheel"] = {"left": {"velocity": 5, "on": 3}}
    assert value.wheel.left.velocity == 1.0
    value.wheel.left.update(velocity=2)
    value["wheel/left"] = [3, True]
    assert value.wheel.left == {"velocity": 3.0, "on": True}
    for wrong in ([1], [1, True, 2]):
        with pytest.raises(FieldValueError, match=r"has 2 fields .* values came"):
            value["wheel/left"] = wrong
    with pytest.raises(FieldValueError, match="expects a dict of fields"):
        value["wheel/left"] = 3


def test_globs_are_live_views(value: DefDict) -> None:
    wheels = value["wheel/*/velocity"]
    assert list(wheels) == ["wheel/left/velocity", "wheel/right/velocity"]
    assert Mapping in type(wheels).__mro__
    wheels["wheel/right/velocity"] = 4.0
    assert value.wheel.right.velocity == 4.0
    assert wheels.to_array().tolist() == [1.0, 4.0]
    value["wheel/*/velocity"] = "1 rad/s"
    assert set(wheels.values()) == {1.0}
    value["wheel/*/velocity"] = [2, 3]
    assert list(wheels.values()) == [2.0, 3.0]
    value["wheel/*/velocity"] = [120, 180] / unyt.minute * unyt.rad
    assert list(wheels.values()) == [2.0, 3.0]
    value["wheel/*/velocity"] = {"wheel/left/velocity": 7}
    assert list(wheels.values()) == [7.0, 3.0]
    assert list(value["**/velocity"]) == [
        "wheel/left/velocity",
        "wheel/right/velocity",
        "arm/wheel/left/velocity",
    ]
    assert list(value["*"]) == ["x", "tags"]
    assert list(value["**"]) == list(ROBOT.paths)
    assert list(value["wheel/**"]) == list(ROBOT.paths[1:5])
    assert list(value["wheel/$*ft/on"]) == ["wheel/left/on"]
    assert list(value.wheel["*/on"]) == ["left/on", "right/on"]


def test_globs_refuse(value: DefDict) -> None:
    before = value.to_dict()
    with pytest.raises(UnknownFieldError, match=r"no field '\*/speed'"):
        value["*/speed"]
    with pytest.raises(FieldValueError, match="selects 2 fields, but 3 values came"):
        value["wheel/*/velocity"] = [1, 2, 3]
    with pytest.raises(FieldValueError):
        value["wheel/*/velocity"] = [1, 99]
    with pytest.raises(UnknownFieldError):
        value["wheel/*/velocity"] = {"x": 1}
    with pytest.raises(UnknownFieldError):
        value["wheel/*/velocity"]["x"]
    with pytest.raises(FixedKeysError):
        value["wheel/*/velocity"].clear()
    assert value == before


def test_an_update_sets_what_it_names_in_either_form(value: DefDict) -> None:
    other = value.copy()
    value.update({"wheel/left/velocity": 3.0})
    other.update({"wheel": {"left": {"velocity": 3.0}}})
    assert other == value
    before = other.copy()
    with pytest.raises(UnknownFieldError, match="velocty"):
        other.update({"wheel": {"left": {"velocity": 4.0, "velocty": 3.0}}})
    assert other == before

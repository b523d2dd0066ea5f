"""Values, groups and globs are computed with, units kept and checked."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rems_net.defdict import DefDict, Schema, angle, array, integer, length, velocity
from rems_net.defdict.fields.makers import temperature, text
from rems_net.errors import FieldValueError, SchemaError, UnitError

unyt = pytest.importorskip("unyt")
STATE = Schema(
    "state",
    {
        "p": {"x": length("m"), "y": length("mm"), "heading": angle()},
        "v": {"x": velocity("m/s", range=(-5, 5)), "y": velocity("m/s", range=(-5, 5))},
        "w": {"x": velocity("km/h"), "y": velocity("km/h")},
        "n": {"a": integer()},
        "f": {"a": array((2,), "m/s")},
        "t": {"a": temperature()},
        "name": text(),
    },
)


@pytest.fixture
def state() -> DefDict:
    return STATE({"v": {"x": 1.0, "y": 2.0}, "p": {"x": 1.0, "y": 500.0}})


def test_a_glob_and_a_group_are_changed_in_place(state: DefDict) -> None:
    state["v/*"] *= 2
    assert state.v.to_array().tolist() == [2.0, 4.0]
    state.v -= 0.5
    state["v"] += 50 * unyt.cm / unyt.s
    state.v += "-1 m/s"
    assert state.v.to_array().tolist() == pytest.approx([1.0, 3.0])
    state["v/*"] /= np.array([1.0, 3.0])
    assert state.v.to_array().tolist() == pytest.approx([1.0, 1.0])
    kept = state["v/*"]
    kept *= 3
    assert state.v.x == pytest.approx(3.0)
    state["n/*"] *= 4
    state.f.a = [1, 2]
    state["f/*"] *= 2
    state.f = state.f + 1
    assert state.f.a.tolist() == [3.0, 5.0]


def test_a_result_has_units_and_is_converted_back(state: DefDict) -> None:
    state["w/*"] = state["v/*"] * 2
    assert state.w.to_array().tolist() == pytest.approx([7.2, 14.4])
    way = (2 * unyt.s) * state.v
    assert str(way.units) == "m"
    assert way.tolist() == [2.0, 4.0]
    assert (np.array([3, 1]) * state.v).to("mm/s").value.tolist() == [3000.0, 2000.0]
    assert (1 - state["v/*"]).value.tolist() == [0.0, -1.0]
    assert (-state.v).value.tolist() == [-1.0, -2.0]
    assert str((1 / state.v).units) == "s/m"
    assert (state.v + state["w/*"]).value.tolist() == pytest.approx([3.0, 6.0])


def test_fields_of_several_units(state: DefDict) -> None:
    state["p/*"] *= 2
    assert state.p.to_array().tolist() == [2.0, 1000.0, 0.0]
    state.p = (state.p + state.p) / 2
    assert state.p.to_array().tolist() == [2.0, 1000.0, 0.0]
    before = state.p.copy()
    with pytest.raises(UnitError, match=r"'p' is in m, mm, rad, and cannot be"):
        state.p += 1 * unyt.m
    assert state.p == before
    state["p/$*"] *= unyt.unyt_quantity(50, "percent")
    assert state.p.x == 1.0
    assert str((state.p * state.p)[1]) == "250000.0 mm**2"


def test_what_is_refused_changes_nothing(state: DefDict) -> None:
    before = state.copy()
    with pytest.raises(UnitError, match="'v/x' expects a number in m/s"):
        state["v/*"] *= 2 * unyt.s
    with pytest.raises(FieldValueError, match=r"'v/y' expects .* got 6.0.* clip\(\)"):
        state["v/*"] *= 3
    with pytest.raises(UnitError, match="'v' is in m/s, and cannot be computed with"):
        state.v += 1 * unyt.m
    with pytest.raises(FieldValueError, match=r"'v' has 2 fields, .* got None"):
        state.v *= None
    with pytest.raises(FieldValueError, match=r"2 fields, .* got \[1, 2, 3\]"):
        state.v *= [1, 2, 3]
    with pytest.raises(FieldValueError, match="'fast'"):
        state.v += "fast"
    with pytest.raises(FieldValueError, match="'name' is str, not a number"):
        state *= 2
    with pytest.raises(FieldValueError, match="'name' is str, not a number"):
        np.asarray(state["**"])
    with pytest.raises(UnitError, match="is in degC"):
        state.t * 2 * unyt.m
    assert state == before


def test_a_read_only_value(state: DefDict) -> None:
    from rems_net.defdict import shown

    view = shown(state, lambda path: SchemaError(f"{path} is another agent's"))
    assert (view["v/*"] * 2).value.tolist() == [2.0, 4.0]
    for change in ("view['v/*'] *= 2", "view.v *= 2", "kept = view['v/*']; kept *= 2"):
        with pytest.raises(SchemaError, match="is another agent's"):
            exec(change, {"view": view})
    assert state.v.x == 1.0


def test_arrays_are_numbers_not_keys(state: DefDict) -> None:
    assert np.asarray(state["v/*"]).tolist() == [1.0, 2.0]
    assert np.asarray(state.v).tolist() == [1.0, 2.0]
    assert np.asarray(state["v/*"], dtype="f4").dtype == np.float32
    assert np.hypot(*np.asarray(state["v/*"])) == pytest.approx(5**0.5)
    with pytest.raises(ValueError, match="leave out copy=False"):
        np.asarray(state["v/*"], copy=False)


@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2))
def test_in_place_is_the_same_as_one_by_one(x: float, y: float, by: float) -> None:
    one, other = STATE(), STATE()
    one.v = other.v = {"x": x, "y": y}
    one["v/*"] *= by
    other.v = {"x": x * by, "y": y * by}
    assert one == other
    one.v = one.v + by / 2
    other.v = {"x": x * by + by / 2, "y": y * by + by / 2}
    assert one == other

"""Names that mean two things: a unit, to calculate with, and what makes a field."""

import copy
import operator
import pickle
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from rems_net import defdict
from rems_net.defdict import Schema, length, percent
from rems_net.defdict.units.table import TABLE as _TABLE
from rems_net.errors import SchemaError, UnitError
from rems_net.units import _QUANTITIES
from tests.commands import python

unyt = pytest.importorskip("unyt")


def test_import_star_hides_nothing() -> None:
    names: dict[str, Any] = {}
    exec("import time, array\nfrom rems_net.defdict import *", names)
    assert names["time"].monotonic() > 0
    assert names["array"].array("d", [1.0])[0] == 1.0
    assert names["length"] is length
    hidden = {"array", "count", "current", "power", "text", "time"}
    assert hidden.isdisjoint(defdict.__all__)
    assert all(callable(getattr(defdict, name)) for name in hidden)


@pytest.mark.parametrize(
    "calculate",
    [
        lambda: 50 * cast("Any", percent),
        lambda: cast("Any", percent) * 50,
        lambda: 50 / cast("Any", percent),
        lambda: np.float64(50) * cast("Any", percent),
    ],
)
def test_a_maker_is_not_a_unit(calculate: Any) -> None:
    with pytest.raises(UnitError) as caught:
        calculate()
    assert str(caught.value) == (
        "percent() makes a field. To calculate with a unit, take one of "
        "rems_net.units: from rems_net.units import percent (R0112)"
    )


def test_a_unit_or_a_maker_is_not_a_field() -> None:
    with pytest.raises(SchemaError) as caught:
        Schema("s", {"p": percent})
    assert str(caught.value) == (
        "s/p must be a field such as length('m'), or a dict of fields; got "
        "<percent(), which makes a field>. Call it: percent(...). (R0112)"
    )
    with pytest.raises(SchemaError) as caught:
        Schema("s", {"p": unyt.percent})
    assert str(caught.value) == (
        "s/p must be a field such as length('m'), or a dict of fields; got %. That is "
        "a unit, to calculate with; what makes a field is in rems_net.units, too: "
        "from rems_net.units import percent, length. (R0112)"
    )


def test_quantities_are_there_beside_units() -> None:
    """By the same objects as in rems_net.defdict; percent is a unit and a quantity."""
    import rems_net.defdict as makers
    from rems_net import units

    for name in _QUANTITIES:
        if name != "percent":
            assert getattr(units, name) is getattr(makers, name)
    assert units.percent(range=(0, 100)) == percent(range=(0, 100))
    assert str((50 * units.percent).units) == "%"


def test_units_module_gives_units_of_unyt() -> None:
    from rems_net.units import cm, percent

    assert 250 * cm == unyt.unyt_quantity(2.5, "m")
    assert str((50 * percent).units) == "%"
    with pytest.raises(UnitError, match="unyt knows no unit 'bananas'"):
        from rems_net.units import bananas  # noqa: F401


def test_percent_is_as_the_unit_of_unyt() -> None:
    from rems_net.units import cm, percent

    for make in (
        lambda unit: 50 * unit,
        lambda unit: unit * 50,
        lambda unit: 50 / unit,
        lambda unit: unit / 50,
        lambda unit: [1, 2] * unit,
        lambda unit: np.arange(3) * unit,
        lambda unit: np.float64(3) / unit,
        lambda unit: (5 * cm) * unit,
        lambda unit: cm / unit,
        lambda unit: unit / cm,
        lambda unit: unit**2,
        lambda unit: unit * unit,
        lambda unit: unyt.unyt_array([3, 4], unit),
        lambda unit: unyt.unyt_quantity(0.5, "").to(unit),
    ):
        ours, theirs = make(percent), make(unyt.percent)
        assert type(ours) is type(theirs)
        assert np.all(ours == theirs)
        assert str(ours) == str(theirs)
    assert (50 * percent).units == percent == unyt.percent != cm
    assert isinstance(percent, unyt.Unit)
    assert pickle.loads(pickle.dumps(percent)) is copy.deepcopy(percent) is percent
    for add in (operator.add, operator.sub):
        with pytest.raises(unyt.exceptions.InvalidUnitOperation):
            add(percent, 1)
    with pytest.raises(SchemaError, match=r"got %\. That is a unit"):
        Schema("s", {"p": percent})


def test_a_field_of_percent_needs_no_unyt(tmp_path: Path) -> None:
    """The import of unyt takes a second, in each process of a run."""
    done = python(
        tmp_path,
        "-c",
        "import sys; from rems_net.units import length, percent; length(); percent(); "
        "assert 'unyt' not in sys.modules; 50 * percent; assert 'unyt' in sys.modules",
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_all_common_units_at_once() -> None:
    """By a star: all of the table, but what Python or rems_net.defdict calls so."""
    names: dict[str, Any] = {}
    exec("from rems_net.units import *", names)
    assert {*_TABLE} - {"min"} | {*_QUANTITIES} == names.keys() - {"__builtins__"}
    assert 25 * names["cm"] == unyt.unyt_quantity(0.25, "m")

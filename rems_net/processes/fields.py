"""Fields of a state: angles, whose differences go the short way; pairs of fields."""

from collections.abc import Sequence
from math import inf, pi
from typing import Any

import numpy as np

from rems_net.defdict import Field, Schema, number, parse_quantity
from rems_net.errors import ExperimentError, nearest
from rems_net.maths.ukf import Floats

#: Units of an angle.
ANGLES = ("rad", "deg", "degree", "arcmin", "arcsec")


class Turns:
    """The length of a full turn in each field's unit; infinite for other fields."""

    def __init__(self, fields: Sequence[Field]):
        self._turn = np.array([_turn(one) for one in fields])
        #: lowest value of angles that have a range of one turn; the others go on
        self._low = np.array([_low(one) for one in fields])

    def extended(self, count: int) -> "Turns":
        """Return this for `count` more values, which are no angles."""
        made = Turns([])
        made._turn = np.concatenate([self._turn, np.full(count, inf)])
        made._low = np.concatenate([self._low, np.full(count, -inf)])
        return made

    def less(self, a: Any, b: Any) -> Any:
        """Return a - b; of angles at most half a turn."""
        off = np.subtract(a, b)
        around = np.isfinite(self._turn)
        turns = np.where(around, self._turn, 1.0)
        return off - np.where(around, turns * np.rint(off / turns), 0.0)

    def wrapped(self, values: Floats) -> Floats:
        """Return values with each angle in its range, if that is one turn."""
        low = self._low[: len(values)]
        inside = np.isfinite(low)
        turns = np.where(inside, self._turn[: len(values)], 1.0)
        first = np.where(inside, low, 0.0)
        around = first + (values - first) - turns * np.floor((values - first) / turns)
        return np.where(inside, around, values)


def _turn(field: Field) -> float:
    if field.unit not in ANGLES:
        return inf
    return float(parse_quantity(f"{2 * pi!r} rad", field.unit))


def _low(field: Field) -> float:
    low, high = field.limits
    turn = _turn(field)
    return low if abs(high - low - turn) < 1e-6 * turn else -inf


def odd(field: Field) -> bool:
    return bool(field.shape) or field.dtype != "float"


def pairs(schema: Schema) -> dict[str, Field]:
    """Return a field for each pair of fields, in its unit: "x/heading" in m*rad."""
    rows = list(schema.rows())
    found = {}
    for i, (path, one) in enumerate(rows):
        for other, two in rows[i:]:
            found[f"{path}/{other}"] = number(_product(one.unit, two.unit))
    return found


def _product(a: str, b: str) -> str:
    """Return the unit of a product: m**2, m*rad."""
    if a == b:
        return a and (f"{a}**2" if a.isalpha() else f"({a})**2")
    return "*".join(unit if unit.isalpha() else f"({unit})" for unit in (a, b) if unit)


def field_of(schema: Schema, path: str, name: str) -> Field:
    found = dict(schema.rows()).get(path)
    if found is None:
        raise ExperimentError(
            f"{name} names {path!r}, and {schema.name} has {', '.join(schema.paths)}."
            f"{nearest(path, schema.paths)} (R0881)"
        )
    return found

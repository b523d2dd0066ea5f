"""A field: the type, unit, range, default and shape of one value.

Fields are made by the functions of `quantities.py` (`length("m", ...)`) and never
change. A field checks itself when it is made, so a schema holds only good ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from rems_net.defdict.unit import find_unit, tidy
from rems_net.errors import SchemaError, UnitError

if TYPE_CHECKING:
    from rems_net.defdict.schema import Schema

__all__ = ["Field"]

Table = tuple[tuple[float, float], ...]
Function = Callable[[float], float]

SCALARS = ("float", "int", "bool", "str", "bytes", "choice", "list")
ARRAYS = ("f8", "f4", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "bool")
INT_MIN, INT_MAX = -(2**63), 2**63 - 1
FLOAT_MAX, FLOAT32_MAX = 1.7976931348623157e308, 3.4028234663852886e38
MAX_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class Field:
    """One named value of a schema. The name is the schema's business.

    `dtype` is float, int, bool, str, bytes, choice or list; for an array (`shape`
    is not empty) it is the numpy type of its elements, such as f8 or u1.
    `range` is inclusive and in `unit`. `max_age` is in seconds.
    `table` and `functions` say what a count stands for, in `means`.
    """

    dtype: str = "float"
    unit: str = ""
    range: tuple[float, float] | None = None
    default: Any = None
    shape: tuple[int, ...] = ()
    max_age: float | None = None
    choices: tuple[str, ...] = ()
    table: Table = ()
    means: str = ""
    functions: tuple[Function, Function] | None = None
    max_len: int = 256
    item: Schema | None = None
    doc: str = ""

    def __post_init__(self) -> None:
        """Check the field and bring it into its one spelling."""
        put = object.__setattr__
        put(self, "unit", tidy(self.unit))
        put(self, "means", tidy(self.means))
        find_unit(self.unit)
        find_unit(self.means)
        self._check_type()
        if self.range is not None:
            put(self, "range", self._checked_range(self.range))
        if self.max_age is not None and not 0 < self.max_age < math.inf:
            raise SchemaError(f"max_age is a time in seconds, not {self.max_age!r}.")
        if self.table:
            put(self, "table", _checked_table(self.table))
        put(self, "default", self._checked_default(self.default))

    def _check_type(self) -> None:
        known = ARRAYS if self.shape else SCALARS
        if self.dtype not in known:
            raise SchemaError(f"dtype {self.dtype!r} is not one of {', '.join(known)}.")
        if any(type(n) is not int or n < 1 for n in self.shape) or len(self.shape) > 8:
            raise SchemaError(f"a shape is whole numbers from 1 up, not {self.shape}.")
        if self.shape and self.size * np.dtype(self.dtype).itemsize > MAX_BYTES:
            raise SchemaError(
                f"an array of shape {self.shape} is beyond {MAX_BYTES} B."
            )
        if self.dtype == "choice" and (
            not self.choices
            or len(set(self.choices)) != len(self.choices)
            or not all(isinstance(one, str) and one for one in self.choices)
        ):
            raise SchemaError("choice() takes one or more different names.")
        if self.dtype == "list" and self.item is None:
            raise SchemaError("a list field needs the schema of its items.")
        if not 0 < self.max_len <= MAX_BYTES:
            raise SchemaError(f"max_len is 1 to {MAX_BYTES}, not {self.max_len!r}.")
        if self.unit and not self.numeric:
            raise SchemaError(f"a {self.dtype} field has no unit.")

    def _checked_range(self, given: Any) -> tuple[float, float]:
        from rems_net.defdict.accept import parse_quantity

        if not self.numeric:
            raise SchemaError(f"a {self.dtype} field has no range.")
        if not isinstance(given, tuple | list) or len(given) != 2:
            raise SchemaError(
                f"a range is a pair such as (-1, 1), lowest first; got {given!r}."
            )
        low, high = (
            one
            if self.whole and type(one) is int
            else parse_quantity(one, self.unit, "a range's end")
            for one in given
        )
        if not low < high:
            raise SchemaError(
                f"a range goes from low to high; got ({low:g}, {high:g})."
            )
        if self.whole:
            if low != int(low) or high != int(high):
                raise SchemaError(
                    f"the range of whole numbers is whole; got {given!r}."
                )
            low, high = int(low), int(high)
        least, most = self.type_limits
        if low < least or high > most:
            raise SchemaError(
                f"{self.dtype} holds {least:.10g} to {most:.10g}; the range "
                f"({low:.10g}, {high:.10g}) goes beyond."
            )
        return low, high

    def _checked_default(self, given: Any) -> Any:
        from rems_net.defdict.accept import accept

        return accept(self, _zero(self) if given is None else given, "the default")

    @property
    def numeric(self) -> bool:
        """Whether the field holds numbers (that may have a unit and a range)."""
        return self.dtype in ("float", "int") or (
            bool(self.shape) and self.dtype != "bool"
        )

    @property
    def whole(self) -> bool:
        """Whether the field holds whole numbers."""
        return self.dtype == "int" or self.dtype[0] in "iu"

    @property
    def size(self) -> int:
        """The number of elements: 1 for a scalar."""
        return math.prod(self.shape)

    @property
    def limits(self) -> tuple[float, float]:
        """The range, or what the type itself can hold."""
        return self.type_limits if self.range is None else self.range

    @property
    def type_limits(self) -> tuple[float, float]:
        """The least and the most that the type can hold."""
        if self.shape and self.whole:
            info = np.iinfo(self.dtype)
            return int(info.min), int(info.max)
        if self.dtype == "int":
            return INT_MIN, INT_MAX
        most = FLOAT32_MAX if self.dtype == "f4" else FLOAT_MAX
        return -most, most

    @property
    def relative(self) -> bool:
        """Whether a value stands for a place in a range (and has no table)."""
        return (
            self.unit in ("percent", "ratio", "count")
            and not self.table
            and self.functions is None
        )

    def describe_type(self) -> str:
        """Return the type in a few words: "float", "f8[3]", "choice"."""
        if self.shape:
            return f"{self.dtype}[{', '.join(map(str, self.shape))}]"
        return self.dtype


def _zero(field: Field) -> Any:
    if field.shape:
        low, high = field.limits
        value = 0 if field.dtype == "bool" else min(max(0, low), high)
        return np.full(field.shape, value, dtype=field.dtype)
    if field.numeric:
        low, high = field.limits
        return min(max(0, low), high)
    if field.dtype == "choice":
        return field.choices[0]
    return {"bool": False, "str": "", "bytes": b"", "list": ()}[field.dtype]


def _checked_table(given: Any) -> Table:
    try:
        points = tuple((float(a), float(b)) for a, b in given)
    except (TypeError, ValueError) as why:
        raise SchemaError("a table is pairs (count, value), at least two.") from why
    if len(points) < 2 or not all(math.isfinite(x) for point in points for x in point):
        raise SchemaError("a table is pairs (count, value) of numbers, at least two.")
    points = tuple(sorted(points))
    if any(a[0] == b[0] for a, b in pairwise(points)):
        raise SchemaError("a table names each count once.")
    ends = [b[1] - a[1] for a, b in pairwise(points)]
    if not (all(step > 0 for step in ends) or all(step < 0 for step in ends)):
        raise SchemaError(
            "the values of a table rise all the way, or fall all the way; "
            "otherwise a value would stand for several counts."
        )
    return points


def check_measures(what: str, unit: str, dimension: object, example: str) -> None:
    """Raise UnitError if the unit does not measure what the quantity is named for."""
    found = find_unit(unit)
    if found.dimension != dimension or found.relative:
        raise UnitError(
            f"{what}() takes a unit such as {example!r}; "
            f"{unit!r} is a unit of {found.measures}."
        )

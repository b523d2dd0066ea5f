"""Field: one named value of a schema, checked when it is made.

Fields are made by the functions of `makers.py` (`length("m", ...)`) and never change. A
field checks itself, so a schema holds only valid fields.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from rems_net.defdict.fields import kind
from rems_net.defdict.fields.accept import accept, parse_quantity
from rems_net.defdict.fields.kind import FLOAT_MAX, MAX_BYTES, Kind, Table
from rems_net.defdict.units.unit import find_unit, tidy
from rems_net.errors import SchemaError
from rems_net.packing import map_header, pack


@dataclass(frozen=True, slots=True, eq=False)
class Field(Kind):
    """One named value of a schema; `Kind` has its properties.

    Two fields are equal if their descriptions are equal. `described` is the field as
    msgpack, `meaning` the same without its doc.
    """

    described: bytes = field(init=False, repr=False)
    meaning: bytes = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the field and bring it into its normal form."""
        put = object.__setattr__
        put(self, "unit", tidy(self.unit))
        put(self, "means", tidy(self.means))
        find_unit(self.unit)
        find_unit(self.means)
        for problem in self._problems():
            raise SchemaError(problem)
        if self.range is not None:
            put(self, "range", self._checked_range(self.range))
        if self.max_age is not None:
            put(self, "max_age", float(self.max_age))
        if self.table:
            put(self, "table", _checked_table(self.table))
        default = self.zero if self.default is None else self.default
        put(self, "default", accept(self, default, "the default"))
        described, meaning = _forms(self)
        put(self, "described", described)
        put(self, "meaning", meaning)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Field):
            return NotImplemented
        return self.described == other.described and self.functions == other.functions

    def __hash__(self) -> int:
        return hash((self.described, self.functions))

    def _problems(self) -> Iterator[str]:
        known = kind.ARRAYS if self.shape else kind.SCALARS
        if self.dtype not in known:
            yield f"dtype {self.dtype!r} is not one of {', '.join(known)}. (R0112)"
        if any(type(n) is not int or n < 1 for n in self.shape) or len(self.shape) > 8:
            yield f"a shape is whole numbers from 1 up, not {self.shape}. (R0112)"
        if self.shape and self.size * self.element.itemsize > MAX_BYTES:
            yield f"an array of shape {self.shape} is beyond {MAX_BYTES} B. (R0112)"
        if self.dtype == "choice":
            names = self.choices
            text = all(isinstance(one, str) and one for one in names)
            if not names or not text or len(set(names)) != len(names):
                yield (
                    "choice() takes one or more different names, such as "
                    "choice('on', 'off'). (R0112)"
                )
            if not all(one.isprintable() for one in names):
                yield f"the names of a choice are printable, not {names!r}. (R0112)"
        if self.dtype == "list" and self.item is None:
            yield "a list field needs the schema of its items: many(schema). (R0112)"
        if type(self.max_len) is not int or not 0 < self.max_len <= MAX_BYTES:
            yield f"max_len is 1 to {MAX_BYTES}, not {self.max_len!r}. (R0112)"
        if self.unit and not self.numeric:
            yield f"a {self.dtype} field has no unit: leave it out. (R0112)"
        if self.max_age is not None and not 0 < self.max_age <= FLOAT_MAX:
            yield f"max_age is a time in seconds, not {self.max_age!r}. (R0112)"

    def _checked_range(self, given: Any) -> tuple[float, float]:
        if not self.numeric:
            raise SchemaError(
                f"a {self.dtype} field has no range: leave range= out. (R0110)"
            )
        if not isinstance(given, tuple | list) or len(given) != 2:
            raise SchemaError(
                "a range is a pair such as (-1, 1), lowest first; got "
                f"{given!r}. (R0110)"
            )
        low, high = (
            one
            if self.whole and type(one) is int
            else parse_quantity(one, self.unit, "a range's end")
            for one in given
        )
        if not low < high:
            raise SchemaError(
                f"a range goes from low to high; got ({low:g}, {high:g}). (R0110)"
            )
        if self.whole:
            if low != int(low) or high != int(high):
                raise SchemaError(
                    f"the range of whole numbers is whole; got {given!r}. (R0110)"
                )
            low, high = int(low), int(high)
        least, most = self.type_limits
        if low < least or high > most:
            raise SchemaError(
                f"{self.dtype} holds {least:.10g} to {most:.10g}; the range "
                f"({low:.10g}, {high:.10g}) goes beyond. (R0110)"
            )
        if not math.isfinite(high - low):
            raise SchemaError(
                f"a range spans less than {FLOAT_MAX:.10g}; ({low:.10g}, {high:.10g}) "
                f"is wider. Without range= any number is taken. (R0110)"
            )
        return low, high


def _checked_table(given: Any) -> Table:
    try:
        points = tuple(sorted((_number(a), _number(b)) for a, b in given))
    except (TypeError, ValueError, OverflowError):
        points = ()
    if len(points) < 2:
        raise SchemaError(
            "a table is pairs (count, value) of finite numbers, at least two, such as "
            "table=[(0, 0.0), (180, 3.1)]. (R0111)"
        )
    if not all(
        math.isfinite(b - a) for a, b in zip(points[0], points[-1], strict=True)
    ):
        raise SchemaError(
            "a table is pairs (count, value) of finite spans: write smaller "
            "numbers. (R0111)"
        )
    if any(a[0] == b[0] for a, b in pairwise(points)):
        raise SchemaError("a table names each count once. (R0111)")
    ends = [b[1] - a[1] for a, b in pairwise(points)]
    if not (all(step > 0 for step in ends) or all(step < 0 for step in ends)):
        raise SchemaError(
            "the values of a table rise all the way, or fall all the way; "
            "otherwise a value would stand for several counts. (R0111)"
        )
    return points


def _number(given: Any) -> float:
    """Return a finite number as a float. Raises ValueError for anything else."""
    number = isinstance(given, int | float | np.number) and type(given) is not bool
    if not number or not math.isfinite(given):
        raise ValueError
    return float(given)


_NAMES = ["choices", "default", "doc", "functions", "item", "max_age", "max_len"]
_NAMES += ["means", "range", "shape", "table", "unit"]


def _forms(field: Kind) -> tuple[bytes, bytes]:
    """Return the description of a field, and its meaning."""
    found = {name: getattr(field, name) for name in _NAMES}
    found["default"] = _default(field)
    found["functions"] = True if field.functions else None
    if field.dtype not in ("str", "bytes", "list"):
        del found["max_len"]
    found = {key: one for key, one in found.items() if one not in (None, "", ())}
    described = pack(field.dtype) + _packed(found, meaning=False)
    if not field.doc and field.item is None:
        return described, described
    found.pop("doc", None)
    return described, pack(field.dtype) + _packed(found, meaning=True)


def _default(field: Kind) -> Any:
    """Return the default for msgpack; None if it is the ordinary one."""
    if field.shape:
        ordinary = np.array_equal(field.default, field.zero)
        return None if ordinary else field.default.tobytes()
    if field.dtype == "list":
        return tuple(item.to_wire_map() for item in field.default)
    return None if field.default == field.zero else field.default


def _packed(found: dict[str, Any], *, meaning: bool) -> bytes:
    item = found.get("item")
    if item is None:
        return pack(found)
    inside = item.meaning if meaning else item.description
    rows = (pack(k) + (inside if k == "item" else pack(v)) for k, v in found.items())
    return map_header(len(found)) + b"".join(rows)

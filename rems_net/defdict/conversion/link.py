"""Link: how one field becomes another, as an expression and in words.

Percent, ratio and count (without a table) are places in their own range: an affine map
takes that range onto the range of the other end.  If two fields measure the same, the
value is converted from unit to unit.  Tables are linear between points.
"""

import math
import re
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rems_net.defdict.fields.accept import accept
from rems_net.defdict.fields.field import Field
from rems_net.defdict.fields.kind import Function, Table
from rems_net.defdict.units.maps import Affine, between, unit_map
from rems_net.defdict.units.unit import find_unit
from rems_net.errors import FieldValueError, UnitError, uncoded

Range = tuple[float, float] | None
#: The end of an error message that explains how to set a number.
_SETTING = re.compile(r'( Did you mean "[^"]*"\?)? To limit it, use clip\(\)\.$')
ROUNDING = 1e-9  # Ratio to the target's span. A conversion may exceed the span by this.


class MismatchError(Exception):
    """The reason why a field cannot become another; `dimension` if it is the units."""

    def __init__(self, why: str, dimension: bool = False) -> None:
        super().__init__(why)
        self.dimension = dimension


@dataclass(slots=True)
class Link:
    """The code that turns `{x}` into a value of the target field."""

    code: str = "{x}"
    factor: str = ""
    inside: bool = False  # the target's limits cannot be exceeded
    slack: float = 0.0  # error from the last digits of the source
    names: dict[str, Any] = field(default_factory=dict)


def link(a: Field, b: Field, tag: str) -> Link:
    """Return how field a becomes field b; raise MismatchError if it cannot.

    `tag` makes the names in the code unique.
    """
    if a.shape != b.shape:
        raise MismatchError(
            f"shape {a.shape or 'of one value'} against {b.shape or 'one'}"
        )
    if a.numeric and b.numeric:
        return _numeric(a, b, tag)
    if a.dtype == "bool" and b.numeric and not b.unit:
        low, high = b.limits
        cast = f"{{x}}.astype({b.dtype!r})" if a.shape else "int({x})"
        if b.dtype == "float":
            cast = "float({x})"
        return Link(cast, "False, True -> 0, 1", low <= 0 and high >= 1)
    if a.dtype == b.dtype == "choice":
        lost = [one for one in a.choices if one not in b.choices]
        if lost:
            raise MismatchError(f"{lost[0]!r} is not one of {', '.join(b.choices)}")
        return Link(inside=True)
    if a.dtype == b.dtype == "list" and a.item is not None and b.item is not None:
        if a.item == b.item and a.max_len <= b.max_len:
            return Link("tuple(item.copy() for item in {x})", inside=True)
        convert = a.item.converter(b.item)
        name = f"convert{tag}"
        return Link(
            f"tuple({name}(item) for item in {{x}})", "each item", names={name: convert}
        )
    if a.dtype == b.dtype and not a.numeric:
        return Link(inside=a.max_len <= b.max_len)
    if {a.dtype, b.dtype} == {"choice", "str"}:
        return Link(inside=False)
    raise MismatchError(f"{a.describe_type()} cannot become {b.describe_type()}")


def guard(b: Field, where: str, unit: str, slack: float) -> Callable[[Any, Any], Any]:
    """Return a function that snaps a value to its limits, or refuses it."""
    low, high = b.limits
    edge = max(_edge(low, high), slack) if b.range is not None else 0.0

    def settle(x: Any, source: Any) -> Any:
        if b.shape:
            near = np.where((x < low) & (x >= low - edge), low, x)
            x = np.where((near > high) & (near <= high + edge), high, near)
            x = _cast(x, b) if b.whole and x.dtype.kind == "f" else x
        elif b.numeric and low - edge <= x < low:
            x = low
        elif b.numeric and high < x <= high + edge:
            x = high
        try:
            return accept(b, x, where)
        except FieldValueError as why:
            came = f"{source!r}{unit and ' ' + unit}"
            # How to set it right is no help here: the user set another value.
            refused = _SETTING.sub("", uncoded(why))
            raise FieldValueError(
                f"{refused} It was converted from {came}. (R0101)"
            ) from why

    return settle


def _edge(low: float, high: float) -> float:
    """Return the largest rounding error: a share of the span, or a few last digits."""
    return max(ROUNDING * (high - low), 8 * math.ulp(max(abs(low), abs(high))))


def _numeric(a: Field, b: Field, tag: str) -> Link:
    names: dict[str, Any] = {}
    code, words = "{x}", []
    unit, span, relative = a.unit, a.range, a.relative
    if a.table or a.functions:
        forward = _reader(a.table) if a.table else a.functions and a.functions[0]
        names[f"value{tag}"] = _elementwise(a, forward)
        code, unit, relative = f"value{tag}({code})", a.means, False
        span = _ends(a.table)
        words.append(f"table of {len(a.table)}" if a.table else "function")
    other, reach, onto = b.unit, b.range, b.relative
    if b.table or b.functions:
        other, reach, onto = b.means, _ends(b.table), False
    step = _step(a, b, (unit, span, relative), (other, reach, onto))
    if step != Affine():
        code = f"({step.code(code)})"
        words.append(step.code("x"))
    if b.table or b.functions:
        inverse = tuple((y, x) for x, y in b.table)
        back = _reader(inverse) if b.table else b.functions and b.functions[1]
        names[f"count{tag}"] = _elementwise(b, back)
        code = f"count{tag}({code})"
        words.append(f"table of {len(b.table)}, back" if b.table else "function, back")
    identity = code == "{x}"
    if b.whole and not (identity and a.whole):
        names["whole"] = np.rint if b.shape else _whole
        code = f"whole({code})"
        words.append("rounded")
    elif not b.shape and not b.whole and identity and a.whole:
        code = "float({x})"
    slack = 0.0
    if span is not None:
        slack = abs(step.factor) * 8 * math.ulp(max(map(abs, span)))
    made = Link(code, ", ".join(words) or "same", _inside(a, b, step, names), slack)
    made.names = names
    return made


def _whole(x: float) -> float | int:
    return round(x) if math.isfinite(x) else x


def _cast(x: np.ndarray[Any, Any], b: Field) -> np.ndarray[Any, Any]:
    """Return rounded numbers as whole ones; those that do not fit stay floats."""
    low, high = b.limits
    top = float(high) if int(float(high)) <= high else math.nextafter(float(high), 0)
    return x.astype(b.dtype) if ((x >= low) & (x <= top)).all() else x


Sense = tuple[str, Range, bool]


def _step(a: Field, b: Field, source: Sense, target: Sense) -> Affine:
    """Return the map between the quantities of two fields."""
    unit, span, relative = source
    other, reach, onto = target
    if relative and onto and unit == other != "count":
        return Affine()
    if relative and onto and {unit, other} == {"percent", "ratio"}:
        return unit_map(unit, other)
    if relative and onto and unit == other and span == reach:
        return Affine()
    if relative or onto:
        if span is None or reach is None:
            whose = "the first" if span is None else "the second"
            share = unit if relative else other
            raise MismatchError(
                f"{share} is a share of a range, and {whose} has none: give it range="
            )
        return between(span, reach)
    try:
        return unit_map(unit, other)
    except UnitError as why:
        raise MismatchError(
            f"{unit or 'a plain number'} ({find_unit(unit).measures}) cannot become "
            f"{other or 'a plain number'} ({find_unit(other).measures})",
            dimension=True,
        ) from why


def _inside(a: Field, b: Field, step: Affine, names: dict[str, Any]) -> bool:
    if names or (b.shape and (a.dtype != b.dtype or step != Affine())):
        return False
    ends = [step(x) for x in a.limits]
    low, high = b.limits
    return all(math.isfinite(x) and low <= x <= high for x in ends)


def _ends(table: Table) -> Range:
    if not table:
        return None
    values = [y for _, y in table]
    return min(values), max(values)


def _reader(table: Table) -> Function:
    """Return a function that interpolates a table; its first column may fall."""
    points = sorted(table)
    xs, ys = [x for x, _ in points], [y for _, y in points]
    edge = _edge(xs[0], xs[-1])

    def read(x: float) -> float:
        if not xs[0] - edge <= x <= xs[-1] + edge:
            raise FieldValueError(
                f"{x:g} is outside the table, which goes from {xs[0]:g} to "
                f"{xs[-1]:g}: extend it, or limit the value. (R0119)"
            )
        i = min(max(bisect_right(xs, x) - 1, 0), len(xs) - 2)
        share = min(max((x - xs[i]) / (xs[i + 1] - xs[i]), 0.0), 1.0)
        return ys[i] + share * (ys[i + 1] - ys[i]) if share < 1.0 else ys[i + 1]

    return read


def _elementwise(one: Field, function: Any) -> Any:
    if not one.shape:
        return function
    return lambda values: np.array([function(float(x)) for x in values.flat]).reshape(
        one.shape
    )

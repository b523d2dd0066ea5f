"""Expression: a reward or an end as text with units, such as "x > 1 m and y < 20 cm".

A name is the end of a field's key, with dots: `x`, `state.x`, `robot.sim.state.x`; a
number may have a unit behind it. `before.x` is the value a step ago. Everything is
calculated in SI units, so a reward of `x` is in metres.
"""

import ast
import operator
import re
from collections.abc import Callable, Sequence
from functools import partial
from math import pi
from typing import Any, NamedTuple

import numpy as np

from rems_net import maths
from rems_net.defdict.units.unit import find_unit, unyt_unit
from rems_net.errors import ExperimentError, RemsError, uncoded
from rems_net.gym.task import Moment, Names

#: Returns the value of an expression from the moments now and a step ago.
Value = Callable[[Moment, Moment], Any]
Dimension = tuple[int, ...] | str
#: exponents of length, mass, time, current and temperature; angles are plain numbers
PLAIN: Dimension = (0, 0, 0, 0, 0)
#: a number, and a unit without blanks: "20 cm", "1.5 m/s**2"
_QUANTITY = re.compile(
    r"(?<![\w.])(\d+\.?\d*(?:[eE][-+]?\d+)?)\s*"
    r"(?!and\b|or\b)([^\W\d]\w*|%|°)((?:[*/][^\W\d]\w*|\*\*-?\d)*)"
)


class Part(NamedTuple):
    """A piece of an expression: its dimension and its value."""

    dimension: Dimension
    value: Value


def _least(a: Any, b: Any) -> Any:
    return np.minimum(a, b) if isinstance(a + b, np.ndarray) else min(a, b)


def _most(a: Any, b: Any) -> Any:
    return np.maximum(a, b) if isinstance(a + b, np.ndarray) else max(a, b)


_SUMS: dict[type, Any] = {ast.Add: operator.add, ast.Sub: operator.sub}
_COMPARE: dict[type, Any] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
#: functions of plain numbers and angles
_PLAIN: dict[str, Callable[..., Any]] = {
    "sin": maths.sin,
    "cos": maths.cos,
    "tan": maths.tan,
}
_PLAIN |= {"exp": maths.exp, "log": maths.log}
#: functions whose result has the unit of their arguments, which have the same one
_SAME: dict[str, Callable[..., Any]] = {
    "abs": abs,
    "min": _least,
    "max": _most,
    "hypot": maths.hypot,
}


def compiled(text: str, names: Names, what: str) -> Value:
    """Return the function of an expression. what: `reward` or `ends`, for messages."""
    if not isinstance(text, str) or not text.strip():
        raise ExperimentError(
            f"{what} is {text!r}; expected an expression, such as 'x > 1 m'. (R0925)"
        )
    found: list[Part] = []

    def keep(match: re.Match[str]) -> str:
        found.append(_quantity(float(match[1]), match[2] + match[3]))
        return f"({_HELD}{len(found) - 1})"

    try:
        tree = ast.parse(_QUANTITY.sub(keep, text).strip(), mode="eval").body
        return _Compiler(names, found).part(tree).value
    except SyntaxError:
        why = "it is no expression"
    except RemsError as error:
        why = uncoded(error).rstrip(".")
    raise ExperimentError(
        f"{what} is {text!r}: {why}. Expected such as 'x > 1 m' or "
        "'before.x - x'. (R0925)"
    )


#: how names of quantities begin while the text is parsed
_HELD = "quantity__"


def _quantity(number: float, unit: str) -> Part:
    dimension, factor = _si(unit)
    value = number * factor
    return Part(dimension, lambda now, before: value)


def _si(unit: str) -> tuple[Dimension, float]:
    """Return the dimension of a unit, and its size in SI units."""
    found = find_unit(unit)
    if found.relative:
        return PLAIN, 1.0
    dimension = found.dimension
    plain = dimension if isinstance(dimension, str) else tuple(dimension[:5])
    if found.size is None:
        return plain, float(unyt_unit(found.text).base_value)
    return plain, float(found.size) * pi**found.pi


class _Compiler:
    def __init__(self, names: Names, held: Sequence[Part]):
        self._names, self._held = names, held

    def part(self, node: ast.expr) -> Part:
        """Return a node as a function. Raises ExperimentError."""
        match node:
            case ast.Constant(bool() | int() | float()):
                number = node.value
                return Part(PLAIN, lambda now, before: number)
            case ast.Name() | ast.Attribute():
                return self._name(node)
            case ast.BinOp():
                return self._sum(node)
            case ast.UnaryOp(ast.USub() | ast.UAdd() as sign, inner):
                part = self.part(inner)
                if isinstance(sign, ast.UAdd):
                    return part
                return part._replace(value=_applied(operator.neg, [part]))
            case ast.UnaryOp(ast.Not(), inner):
                part = self.part(inner)
                return Part(PLAIN, _applied(lambda one: one ^ True, [part]))
            case ast.BoolOp(op, values):
                both = operator.and_ if isinstance(op, ast.And) else operator.or_
                parts = [self.part(one) for one in values]
                return Part(PLAIN, _applied(partial(_folded, both), parts))
            case ast.Compare():
                return self._compare(node)
            case ast.Call(ast.Name(function), arguments, []):
                return self._call(function, [self.part(one) for one in arguments])
        raise ExperimentError(
            f"{ast.unparse(node)!r} cannot be calculated here (R0925)"
        )

    def _name(self, node: ast.expr) -> Part:
        text = ast.unparse(node)
        if text.startswith(_HELD):
            return self._held[int(text.removeprefix(_HELD))]
        first, _, rest = text.partition(".")
        past = first == "before" and bool(rest)
        name = (rest if past else text).replace(".", "/")
        port, path, field = self._names.find(name)
        if field.shape or not (field.numeric or field.dtype == "bool"):
            raise ExperimentError(f"{name} is no number (R0925)")
        dimension, factor = _si(field.unit)

        def value(now: Moment, before: Moment) -> Any:
            found = (before if past else now).port(port)[path]
            return found if factor == 1.0 else found * factor

        return Part(dimension, value)

    def _sum(self, node: ast.BinOp) -> Part:
        a, b = self.part(node.left), self.part(node.right)
        if type(node.op) in _SUMS:
            self._alike([a, b], node)
            return a._replace(value=_applied(_SUMS[type(node.op)], [a, b]))
        if isinstance(node.op, ast.Mult | ast.Div):
            sign = 1 if isinstance(node.op, ast.Mult) else -1
            function = operator.mul if sign == 1 else operator.truediv
            return Part(_product(a, b, sign), _applied(function, [a, b]))
        if isinstance(node.op, ast.Pow) and isinstance(node.right, ast.Constant):
            power = node.right.value
            if type(power) is int and not isinstance(a.dimension, str):
                dimension = tuple(power * one for one in a.dimension)
                return Part(dimension, _applied(operator.pow, [a, b]))
        raise ExperimentError(
            f"{ast.unparse(node)!r} cannot be calculated here (R0925)"
        )

    def _compare(self, node: ast.Compare) -> Part:
        parts = [self.part(one) for one in (node.left, *node.comparators)]
        self._alike(parts, node)
        functions = [_COMPARE.get(type(one)) for one in node.ops]
        if not all(functions):
            raise ExperimentError(f"{ast.unparse(node)!r} compares no numbers (R0925)")

        def compare(*values: Any) -> Any:
            rows = zip(functions, values, values[1:], strict=False)
            return _folded(operator.and_, *(f(a, b) for f, a, b in rows if f))

        return Part(PLAIN, _applied(compare, parts))

    def _call(self, name: str, parts: list[Part]) -> Part:
        wanted = {"abs": 1, "sqrt": 1, "atan2": 2, "min": 2, "max": 2, "hypot": 2}
        known = sorted({*wanted, *_PLAIN})
        if name not in known or len(parts) != wanted.get(name, 1):
            raise ExperimentError(
                f"there is no function {name}() of {len(parts)}; there is "
                f"{', '.join(known)} (R0925)"
            )
        self._alike(parts, name)
        first = parts[0].dimension
        if name in _SAME:
            return Part(first, _applied(_SAME[name], parts))
        if name == "atan2":
            return Part(PLAIN, _applied(maths.atan2, parts))
        if name == "sqrt" and not isinstance(first, str):
            half = tuple(one // 2 for one in first)
            if tuple(2 * one for one in half) == first:
                return Part(half, _applied(lambda one: one**0.5, parts))
        if first != PLAIN or name == "sqrt":
            raise ExperimentError(f"{name}() takes a number without a unit (R0925)")
        return Part(PLAIN, _applied(_PLAIN[name], parts))

    @staticmethod
    def _alike(parts: Sequence[Part], node: ast.expr | str) -> None:
        if len({part.dimension for part in parts}) > 1:
            text = node if isinstance(node, str) else ast.unparse(node)
            text = re.sub(rf"\(?{_HELD}\d+\)?", "...", text)
            raise ExperimentError(
                f"{text!r} joins values of different kinds, such as a length and a "
                "plain number; write its unit, such as 1 m (R0925)"
            )


def _product(a: Part, b: Part, sign: int) -> Dimension:
    if isinstance(a.dimension, str) or isinstance(b.dimension, str):
        raise ExperimentError(
            "a product of such units cannot be calculated here (R0925)"
        )
    pairs = zip(a.dimension, b.dimension, strict=True)
    return tuple(one + sign * other for one, other in pairs)


def _applied(function: Callable[..., Any], parts: Sequence[Part]) -> Value:
    values = [part.value for part in parts]
    if len(values) == 1:
        (one,) = values
        return lambda now, before: function(one(now, before))
    if len(values) == 2:
        first, second = values
        return lambda now, before: function(first(now, before), second(now, before))
    return lambda now, before: function(*(value(now, before) for value in values))


def _folded(function: Callable[[Any, Any], Any], first: Any, *rest: Any) -> Any:
    for one in rest:
        first = function(first, one)
    return first

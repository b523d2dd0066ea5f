"""Expression: a number of some ports as text, such as "x > 1 m and y < 20 cm".

A name is the end of a field's key, with dots: `x`, `state.x`, `sim.state.x`; a number
may have a unit behind it. Everything is calculated in SI units, so `x` is in metres.
Values are numbers or arrays: of many robots, or of all ticks of a run. A result that
cannot be calculated, such as 1 / 0, is nan or infinite.
"""

import ast
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import nan, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from rems_net import maths
from rems_net.defdict.fields.field import Field
from rems_net.defdict.schema import Schema
from rems_net.defdict.units.unit import find_unit, unyt_unit
from rems_net.errors import ExperimentError, UnknownFieldError, nearest, some

#: key of a port, and path of a field in it
Place = tuple[str, str]
Dimension = tuple[int, ...] | str
#: exponents of length, mass, time, current and temperature; angles are plain numbers
PLAIN: Dimension = (0, 0, 0, 0, 0)
_SI = ("m", "kg", "s", "A", "K")
#: a number, and a unit without blanks: "20 cm", "1.5 m/s**2"
_QUANTITY = re.compile(
    r"(?<![\w.])(\d+\.?\d*(?:[eE][-+]?\d+)?)\s*"
    r"(?!and\b|or\b)([^\W\d]\w*|%|°)((?:[*/][^\W\d]\w*|\*\*-?\d)*)"
)
#: characters of an expression
LONGEST = 1000


class Names:
    """The fields of some ports, by any end of their keys that is one field's only.

    `x` is the only field with the path `x`, or the only one of a state; `compass/x` may
    stand beside it.
    """

    def __init__(self, schemas: Mapping[str, Schema]):
        #: key of the field -> key of its port, path and field
        self.fields = {
            f"{key}/{path}": (key, path, field)
            for key, schema in schemas.items()
            for path, field in schema.rows()
        }
        self._found: dict[str, tuple[str, str, Field]] = {}

    def find(self, name: str) -> tuple[str, str, Field]:
        """Return port, path and field of a name. Raises UnknownFieldError."""
        if name not in self._found:
            end = name.replace(".", "/")
            whole = [k for k, (_, path, _) in self.fields.items() if path == end]
            state = [k for k in whole if k.endswith(f"/state/{end}")]
            ends = [k for k in self.fields if k == end or k.endswith(f"/{end}")]
            found = next((one for one in (whole, state) if len(one) == 1), ends)
            if len(found) != 1:
                known = [dotted(key) for key in ends or self.fields]
                which = "write more of its name, such as" if ends else "there is"
                raise UnknownFieldError(
                    f"{name!r} is {'several values' if ends else 'no value'} here; "
                    f"{which} {some(known)}."
                    f"{'' if ends else nearest(name, known)} (R0925)"
                )
            self._found[name] = self.fields[found[0]]
        return self._found[name]


def dotted(key: str) -> str:
    """Return the name of a field's key, as expressions have it: `sim.state.x`."""
    return key.partition("/")[2].replace("/", ".")


class Moment:
    """The values of some ports at one tick, in the units of their fields.

    `now["x"]`, `now["state/x"]` and `now["robot/sim/state/x"]` are the same if no other
    field ends so. In an environment of many robots, values are arrays of all of them.
    """

    __slots__ = ("_names", "_ports")

    def __init__(self, names: Names, ports: Mapping[str, Any]):
        self._names, self._ports = names, ports

    def __getitem__(self, name: str) -> Any:
        port, path, _ = self._names.find(name)
        return self._ports[port][path]

    def port(self, key: str) -> Any:
        """Return a whole port by its key, such as `robot/sim/state`."""
        return self._ports[key]


#: Returns the value of an expression from the moments now and a step ago.
Value = Callable[[Moment, Moment], Any]


class Part(NamedTuple):
    """A piece of an expression: its dimension, its value, and the unit of that."""

    dimension: Dimension
    value: Value
    unit: str = ""
    #: whether it is true or false
    truth: bool = False


class Expression(NamedTuple):
    """A compiled expression.

    unit: of its values.  places: of the fields that it reads.  lasting: whether it has
    a function over all ticks.  truth: whether it is true or false.
    """

    value: Value
    unit: str
    places: Sequence[Place]
    lasting: bool
    truth: bool


def _least(a: Any, b: Any) -> Any:
    return np.minimum(a, b) if isinstance(a + b, np.ndarray) else min(a, b)


def _root(x: Any) -> Any:
    # Both are exact to the last bit; a power of 0.5 is not.
    return sqrt(x) if isinstance(x, float | int) else np.sqrt(x)


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
    name: getattr(maths, name) for name in ("sin", "cos", "tan", "exp", "log")
}
#: Functions whose result has the unit of their arguments, which have the same one;
#: each with the number of these.
_SAME: dict[str, tuple[int, Callable[..., Any]]] = {
    "abs": (1, abs),
    "min": (2, _least),
    "max": (2, _most),
    "hypot": (2, maths.hypot),
}
#: functions of the values at all ticks
_LASTING: dict[str, Callable[..., Any]] = {
    **{"min": np.min, "max": np.max, "mean": np.mean},
    **{"first": lambda values: values[0], "last": lambda values: values[-1]},
}


def compiled(text: str, names: Names, *, lasting: bool = False) -> Expression:
    """Return an expression, ready to be calculated. Raises RemsError.

    lasting: for values of all ticks of a run, with functions over them; otherwise,
    `before.x` is the value a step ago.
    """
    if not isinstance(text, str) or len(text) > LONGEST:
        hint = (
            "; a function is a method of a class below Task" if callable(text) else ""
        )
        raise ExperimentError(
            f"it is no text of at most {LONGEST} characters{hint} (R0925)"
        )

    try:
        # Python has no quantities, so they are parsed as texts.
        tree = ast.parse(_QUANTITY.sub(r"'\g<0>'", text).strip(), mode="eval").body
    except (SyntaxError, TypeError, ValueError, RecursionError, MemoryError):
        alone = re.search(r"[^=<>!]=[^=]", text)
        hint = "; == compares" if alone else ""
        raise ExperimentError(f"it is no expression{hint} (R0925)") from None
    compiler = _Compiler(names, lasting)
    part = compiler.part(tree)
    places = [*compiler.places]
    value = _finished(part.value)
    return Expression(value, part.unit, places, compiler.lasts, part.truth)


def _finished(value: Value) -> Value:
    """Return a value that is nan or infinite where it cannot be calculated."""

    def calculated(now: Moment, before: Moment) -> Any:
        with np.errstate(all="ignore"):
            try:
                return value(now, before)
            except (ArithmeticError, ValueError):  # of numbers; arrays go on
                return nan

    return calculated


def _quantity(number: float, unit: str) -> Part:
    dimension, factor, shown = _si(unit)
    value = number * factor
    return Part(dimension, lambda now, before: value, shown)


def _si(unit: str) -> tuple[Dimension, float, str]:
    """Return the dimension of a unit, its size in SI units, and the SI unit."""
    found = find_unit(unit)
    if found.relative:
        return PLAIN, 1.0, found.text
    dimension = found.dimension
    plain = dimension if isinstance(dimension, str) else tuple(dimension[:5])
    if found.size is None:
        size = float(unyt_unit(found.text).base_value)
    else:
        size = float(found.size) * pi**found.pi
    angle = "rad" if plain == PLAIN and any(dimension) else ""
    return plain, size, found.text if size == 1.0 else angle or _text(plain)


def _text(dimension: Dimension) -> str:
    """Return the SI unit of a dimension: `m/s**2`."""
    if isinstance(dimension, str):
        return ""
    pairs = [*zip(_SI, dimension, strict=True)]
    above, below = (
        [f"{unit}**{abs(n)}" if abs(n) > 1 else unit for unit, n in pairs if n * s > 0]
        for s in (1, -1)
    )
    return "/".join(["*".join(above) or "1", *below]) if above or below else ""


class _Compiler:
    def __init__(self, names: Names, lasting: bool):
        self._names, self._lasting = names, lasting
        self.places: dict[Place, None] = {}
        self.lasts = False

    def part(self, node: ast.expr) -> Part:
        """Return a node as a function. Raises RemsError."""
        match node:
            case ast.Constant(bool() | int() | float() as given):
                truth = isinstance(given, bool)
                number = given if truth else float(given)
                return Part(PLAIN, lambda now, before: number, "", truth)
            case ast.Constant(str(text)) if found := _QUANTITY.fullmatch(text):
                return _quantity(float(found[1]), found[2] + found[3])
            case ast.Name() | ast.Attribute():
                return self._name(node)
            case ast.Subscript(ast.Name() | ast.Attribute(), ast.Constant(int())):
                return self._name(node.value, node.slice.value)  # type: ignore[attr-defined]
            case ast.BinOp():
                return self._sum(node)
            case ast.UnaryOp(ast.USub() | ast.UAdd() as sign, inner):
                part = self.part(inner)
                if isinstance(sign, ast.UAdd):
                    return part
                return part._replace(value=_applied(operator.neg, [part]))
            case ast.UnaryOp(ast.Not(), inner):
                parts = self._truths([inner])
                return Part(PLAIN, _applied(lambda one: one ^ True, parts), "", True)
            case ast.BoolOp(op, values):
                both = operator.and_ if isinstance(op, ast.And) else operator.or_
                parts = self._truths(values)
                return Part(PLAIN, _applied(partial(_folded, both), parts), "", True)
            case ast.Compare():
                return self._compare(node)
            case ast.Call(ast.Name(function), arguments, []):
                return self._call(function, arguments)
        raise _never(node)

    def _name(self, node: ast.expr, element: int | None = None) -> Part:
        text = ast.unparse(node)
        past = text.startswith("before.") and not self._lasting
        name = text.removeprefix("before.") if past else text
        port, path, field = self._names.find(name)
        if not (field.numeric or field.dtype == "bool"):
            raise ExperimentError(f"{name} is no number (R0925)")
        if (element is None) == bool(field.shape):
            kind = "an array; name one element, such as" if field.shape else "no array,"
            raise ExperimentError(f"{name} is {kind} {name}[0] (R0925)")
        self.places[port, path] = None
        dimension, factor, unit = _si(field.unit)

        def value(now: Moment, before: Moment) -> Any:
            found = (before if past else now).port(port)[path]
            if element is not None:
                found = found[..., element]
            return found if factor == 1.0 else found * factor

        return Part(dimension, value, unit, field.dtype == "bool")

    def _truths(self, nodes: Sequence[ast.expr]) -> list[Part]:
        """Return these parts. Raises ExperimentError if one is not true or false."""
        parts = [self.part(one) for one in nodes]
        for part, node in zip(parts, nodes, strict=True):
            if not part.truth:
                raise ExperimentError(
                    f"{_shown(node)!r} is a number, neither true nor false; compare "
                    "it, such as x > 1 m (R0925)"
                )
        return parts

    def _sum(self, node: ast.BinOp) -> Part:
        a, b = self.part(node.left), self.part(node.right)
        if type(node.op) in _SUMS:
            self._alike([a, b], node)
            return a._replace(value=_applied(_SUMS[type(node.op)], [a, b]))
        if isinstance(node.op, ast.Mult | ast.Div):
            sign = 1 if isinstance(node.op, ast.Mult) else -1
            function = operator.mul if sign == 1 else operator.truediv
            dimension = _product(a, b, sign)
            unit = _text(dimension)
            if b.dimension == PLAIN and not b.unit:
                unit = a.unit
            elif a.dimension == PLAIN and not a.unit and sign == 1:
                unit = b.unit
            return Part(dimension, _applied(function, [a, b]), unit)
        if isinstance(node.op, ast.Pow) and isinstance(node.right, ast.Constant):
            power = node.right.value
            if type(power) is int and not isinstance(a.dimension, str):
                dimension = tuple(power * one for one in a.dimension)
                value = _applied(operator.pow, [a, b])
                return Part(dimension, value, _text(dimension))
        raise _never(node)

    def _compare(self, node: ast.Compare) -> Part:
        parts = [self.part(one) for one in (node.left, *node.comparators)]
        self._alike(parts, node)
        functions = [_COMPARE.get(type(one)) for one in node.ops]
        if not all(functions):
            raise ExperimentError(f"{_shown(node)!r} compares no numbers (R0925)")

        def compare(*values: Any) -> Any:
            rows = zip(functions, values, values[1:], strict=False)
            return _folded(operator.and_, *(f(a, b) for f, a, b in rows if f))

        return Part(PLAIN, _applied(compare, parts), "", True)

    def _call(self, name: str, arguments: Sequence[ast.expr]) -> Part:
        if self._lasting and name in _LASTING and len(arguments) == 1:
            self.lasts = True
            part = self.part(arguments[0])
            return part._replace(value=_applied(_LASTING[name], [part]))
        counts = {one: count for one, (count, _) in _SAME.items()} | {"atan2": 2}
        known = {*counts, *_PLAIN, "sqrt", *(_LASTING if self._lasting else ())}
        if name not in known or len(arguments) != counts.get(name, 1):
            raise ExperimentError(
                f"there is no function {name}() of {len(arguments)}; there is "
                f"{', '.join(sorted(known))} (R0925)"
            )
        parts = [self.part(one) for one in arguments]
        self._alike(parts, name)
        first = parts[0].dimension
        if name in _SAME:
            return parts[0]._replace(value=_applied(_SAME[name][1], parts))
        if name == "atan2":
            return Part(PLAIN, _applied(maths.atan2, parts), "rad")
        if name == "sqrt" and not isinstance(first, str):
            half = tuple(one // 2 for one in first)
            if tuple(2 * one for one in half) == first:
                return Part(half, _applied(_root, parts), _text(half))
        if first != PLAIN or name == "sqrt":
            raise ExperimentError(f"{name}() takes a number without a unit (R0925)")
        return Part(PLAIN, _applied(_PLAIN[name], parts))

    @staticmethod
    def _alike(parts: Sequence[Part], node: ast.expr | str) -> None:
        if len({part.dimension for part in parts}) > 1:
            text = node if isinstance(node, str) else _shown(node)
            units = dict.fromkeys(part.unit or "a plain number" for part in parts)
            raise ExperimentError(
                f"in {text!r} {' and '.join(units)} do not fit; write units, such as "
                "1 m (R0925)"
            )


def _never(node: ast.expr) -> ExperimentError:
    """Return the error of a piece that cannot be calculated, with what is meant."""
    instead = ""
    match node:
        case ast.BinOp(op=ast.BitXor()):
            instead = "; a power is x**2"
        case ast.BinOp(op=ast.BitAnd() | ast.BitOr()):
            instead = "; write `and` or `or`"
        case ast.Call(ast.Attribute(attr=name)):
            instead = f"; write {name}(...) alone"
    return ExperimentError(
        f"{_shown(node)!r} cannot be calculated here{instead} (R0925)"
    )


def _shown(node: ast.expr) -> str:
    """Return the text of a piece, shortened, with quantities as they were typed."""
    return ast.unparse(node).replace("'", "")[:60]


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

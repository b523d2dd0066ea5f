"""Measures: numbers of a run, from expressions such as `max(sim.state.x) - 1 m`.

An expression is read by Python's parser and computed here, by a few functions and
operators. Each value is an array (n,) over the ticks of a run; the last one counts.
"""

from __future__ import annotations

import ast
import importlib
import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rems_net.agents.agent import Agent
from rems_net.agents.robot import Robot
from rems_net.defdict import Schema
from rems_net.errors import ExperimentError, nearest, some

#: functions over the ticks of a run; with them, a value is kept at each tick
OVER_TIME: dict[str, Callable[..., Any]] = {
    **{"min": np.min, "max": np.max, "mean": np.mean},
    **{"first": lambda values: values[0], "last": lambda values: values[-1]},
}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **OVER_TIME,
    **{"abs": np.abs, "hypot": np.hypot, "sqrt": np.sqrt, "sin": np.sin, "cos": np.cos},
}
OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    **{ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul},
    **{ast.Div: operator.truediv, ast.Pow: operator.pow, ast.USub: operator.neg},
    **{ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt},
    **{ast.GtE: operator.ge, ast.Eq: operator.eq, ast.NotEq: operator.ne},
}
#: `1 m`, `0.5 m/s`: a number with its unit, in an expression
_QUANTITY = re.compile(
    r"(?<![\w.])(\d+(?:\.\d+)?(?:e[-+]?\d+)?)\s*"
    r"((?!(?:and|or|if|in|is|not)\b)[^\W\d]\w*(?:/(?:s|min|h)\b(?:\*\*2)?)?|%)"
)
#: `goal = hypot(x, y)`
_NAMED = re.compile(r"\s*([^\W\d]\w*)\s*=(?!=)(.*)", re.S)


class Place(NamedTuple):
    """Place of a value in an experiment: `robot/sim`, `state`, `x`."""

    agent: str
    port: str
    path: str

    @property
    def name(self) -> str:
        """The name as it is written in an expression: `sim.state.x`."""
        words = (self.agent.partition("/")[2], self.port, self.path.replace("/", "."))
        return ".".join(words)


#: values at each tick, or at the last one only
Kept = Mapping[Place, Sequence[Any]]
#: units of values
Units = Mapping[Place, str]


@dataclass(frozen=True)
class Measure:
    """One column of results: its name, its expression, and the values that it reads."""

    name: str
    tree: ast.expr
    places: Mapping[str, Place]
    lasting: bool

    def value(self, kept: Kept, units: Units) -> tuple[Any, str]:
        """Return its value at the end of a run, as plain data, and its unit.

        Raises ExperimentError.
        """
        if (alone := self.places.get(ast.unparse(self.tree))) is not None:
            return plain(kept[alone][-1]), units[alone]
        try:
            with np.errstate(all="ignore"):
                found = self._of(self.tree, kept, units)
        except Exception as error:  # unyt has a dozen kinds of its own
            both = re.findall(r"'(\S+)' \(dimensions", str(error))
            why = f"{' and '.join(both)} do not fit" if both else str(error)
            raise _refused(self.name, why.rstrip(".")) from None
        unit = str(getattr(found, "units", ""))
        last = np.asarray(found)
        last = last[-1] if last.ndim else last
        if last.ndim:
            raise _refused(self.name, "it is an array; name one element, such as [0]")
        return plain(last.item()), "" if unit == "dimensionless" else unit

    def _of(self, node: ast.AST, kept: Any, units: Any) -> Any:
        def of(inner: ast.AST) -> Any:
            return self._of(inner, kept, units)

        if isinstance(node, ast.Attribute | ast.Name):
            place = self.places[ast.unparse(node)]
            return with_unit(np.asarray(kept[place]), units[place])
        match node:
            case ast.Constant(value=int() | float() as number):
                return number
            case ast.Call(func=ast.Name("_quantity"), args=[number, unit]):
                return with_unit(np.float64(of(number)), str(unit.value))  # type: ignore[attr-defined]
            case ast.Call(func=ast.Name(name), args=args, keywords=[]):
                return FUNCTIONS[name](*map(of, args))
            case ast.BinOp(left=left, op=op, right=right):
                return OPERATORS[type(op)](of(left), of(right))
            case ast.UnaryOp(op=op, operand=inner):
                return OPERATORS[type(op)](of(inner))
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                return OPERATORS[type(op)](of(left), of(right))
            case ast.Subscript(value=inner, slice=ast.Constant(value=int() as i)):
                return of(inner)[..., i]
        raise KeyError(ast.unparse(node))


def with_unit(values: Any, unit: str) -> Any:
    """Return values with a unit of unyt; a truth value has none."""
    if values.dtype.kind == "b":
        return values
    unyt: Any = importlib.import_module("unyt")  # takes most of a second to load
    return unyt.unyt_array(values, unit)


def plain(value: Any) -> Any:
    """Return a number, a truth value or a text as plain data."""
    return value.item() if isinstance(value, np.generic) else value


def measures(texts: Sequence[str], agents: Mapping[str, Agent]) -> list[Measure]:
    """Return the measures of these expressions; without any, all states at the end.

    Raises ExperimentError for an expression that cannot be computed.
    """
    places = [*_places(agents)]
    if not texts:
        return [_usual(one) for one in places if _is_usual(one, agents)]
    return [_read(text, places, agents) for text in texts]


def _places(agents: Mapping[str, Agent]) -> Iterator[Place]:
    for key, agent in agents.items():
        for port, schema in agent.published().items():
            yield from (Place(key, port, path) for path in schema.paths)


def _is_usual(place: Place, agents: Mapping[str, Agent]) -> bool:
    one = field_of(place, agents)
    state = isinstance(agents[place.agent], Robot) and place.port == "state"
    return state and not one.shape and one.dtype in ("float", "int", "bool")


def field_of(place: Place, agents: Mapping[str, Agent]) -> Any:
    """Return the field of a value."""
    schema: Schema = agents[place.agent].published()[place.port]
    return schema.fields[schema.paths.index(place.path)]


def _usual(place: Place) -> Measure:
    tree = ast.parse(place.name, mode="eval").body
    return Measure(place.name, tree, {place.name: place}, False)


def _read(text: str, places: Sequence[Place], agents: Mapping[str, Agent]) -> Measure:
    named = _NAMED.fullmatch(text)
    name, expression = (named[1], named[2]) if named else (text.strip(), text)
    marked = _QUANTITY.sub(r"_quantity(\1, '\2')", expression.strip())
    try:
        tree = ast.parse(marked, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise _refused(text, "this is no expression") from None
    known = {place.name: place for place in places}
    robots = [key for key in agents if key.startswith("robot/")]
    if len(robots) == 1:  # its name can be left out, and `state`, too
        own = [place for place in places if place.agent == robots[0]]
        short = {f"{p.port}.{p.path}".replace("/", "."): p for p in own}
        state = {p.path.replace("/", "."): p for p in own if p.port == "state"}
        known = {**state, **short, **known}
    found: dict[str, Place] = {}
    called = [n.func.id for n in ast.walk(tree) if _is_call(n)]  # type: ignore[attr-defined]
    for node in _values(tree):
        if (path := ast.unparse(node)) not in known:
            have = f"{some(known)}.{nearest(path, known)}"
            raise _refused(text, f"there is no value {path!r}; there is {have}"[:-1])
        found[path] = known[path]
    if unknown := [n for n in called if n not in (*FUNCTIONS, "_quantity")]:
        raise _refused(
            text,
            f"there is no function {unknown[0]!r}; there is {', '.join(FUNCTIONS)}",
        )
    lasting = bool({*called} & OVER_TIME.keys())
    made = Measure(name, tree, found, lasting)
    made.value(*sampled([made], agents))  # its units fit
    return made


def _is_call(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name)


def _values(node: ast.AST) -> Iterator[ast.expr]:
    """Yield the outermost names and attributes: `sim.state.x`."""
    if isinstance(node, ast.Attribute | ast.Name):
        yield node
        return
    inner = node.args if isinstance(node, ast.Call) else ast.iter_child_nodes(node)
    for child in inner:
        yield from _values(child)


def sampled(
    some: Sequence[Measure], agents: Mapping[str, Agent]
) -> tuple[dict[Place, list[Any]], dict[Place, str]]:
    """Return the values of agents as they are now, as one tick, and their units."""
    places = {place for one in some for place in one.places.values()}
    kept = {p: [getattr(agents[p.agent], p.port)[p.path]] for p in places}
    return kept, {p: field_of(p, agents).unit for p in places}


def _refused(text: str, why: str) -> ExperimentError:
    return ExperimentError(
        f"{text!r} cannot be measured: {why}. Expected an expression, such as "
        "sim.state.x, max(sim.state.x) or hypot(x, y) - 1 m. (R1023)"
    )

"""Measures: numbers of a run, from expressions such as `max(sim.state.x) - 1 m`."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rems_net.agents.agent import Agent
from rems_net.agents.robot import Robot
from rems_net.defdict.expression import (
    Expression,
    Moment,
    Names,
    Place,
    compiled,
    dotted,
)
from rems_net.errors import ExperimentError, RemsError, because

#: `goal = hypot(x, y)`
_NAMED = re.compile(r"\s*([^\W\d]\w*)\s*=(?!=)(.*)", re.S)
#: values at each tick, or at the last one only
Kept = Mapping[Place, Sequence[Any]]


class Measure(NamedTuple):
    """One column of results: its name, its unit, and the values that it reads.

    lasting: whether it reads all ticks.  names, expression: none for a plain value.
    """

    name: str
    unit: str
    places: Sequence[Place]
    lasting: bool = False
    names: Names | None = None
    expression: Expression | None = None

    def value(self, kept: Kept) -> tuple[Any, str]:
        """Return its value at the end of a run, as plain data, and its unit.

        Raises ExperimentError.
        """
        if self.names is None or self.expression is None:
            return plain(kept[self.places[0]][-1]), self.unit
        ports: dict[str, dict[str, Any]] = {}
        for port, path in self.places:
            ports.setdefault(port, {})[path] = np.asarray(kept[port, path])
        now = Moment(self.names, ports)
        try:
            with np.errstate(all="ignore"):
                found = np.asarray(self.expression.value(now, now))
        except ArithmeticError as error:
            raise _refused(self.name, because(error)) from None
        return plain((found[-1] if found.ndim else found)[()]), self.unit


def plain(value: Any) -> Any:
    """Return a number, a truth value or a text as plain data."""
    return value.item() if isinstance(value, np.generic) else value


def measures(texts: Sequence[str], agents: Mapping[str, Agent]) -> list[Measure]:
    """Return the measures of these expressions; without any, all states at the end.

    Raises ExperimentError for an expression that cannot be computed.
    """
    ports = {
        f"{key}/{port}": schema
        for key, agent in agents.items()
        for port, schema in agent.published().items()
    }
    names = Names(ports)
    if not texts:
        states = {f"{key}/state" for key, a in agents.items() if isinstance(a, Robot)}
        return [
            Measure(dotted(key), field.unit, [(port, path)])
            for key, (port, path, field) in names.fields.items()
            if port in states and not field.shape
            if field.dtype in ("float", "int", "bool")
        ]
    found = [_read(text, names, agents) for text in texts]
    taken = {"run", "seed", "status", "ticks", "error"}
    for one in found:
        if one.name in taken:
            raise _refused(
                one.name, "the table has a column of this name; call it other = ... ."
            )
        taken.add(one.name)
    return found


def _read(text: str, names: Names, agents: Mapping[str, Agent]) -> Measure:
    named = _NAMED.fullmatch(text)
    name, expression = (named[1], named[2]) if named else (text.strip(), text)
    try:
        if re.fullmatch(r"[\w.]+", word := expression.strip()) and word[:1].isalpha():
            port, path, field = names.find(word)
            if not field.shape:
                return Measure(name, field.unit, [(port, path)])
        made = compiled(expression, names, lasting=True)
    except RemsError as error:
        raise _refused(text, because(error)) from None
    return Measure(name, made.unit, made.places, made.lasting, names, made)


def sampled(
    some: Sequence[Measure], agents: Mapping[str, Agent]
) -> dict[Place, list[Any]]:
    """Return the values of agents as they are now, as one tick."""
    found: dict[Place, list[Any]] = {}
    for port, path in dict.fromkeys(place for one in some for place in one.places):
        key, _, own = port.rpartition("/")
        found[port, path] = [getattr(agents[key], own)[path]]
    return found


def _refused(text: str, why: str) -> ExperimentError:
    return ExperimentError(
        f"{text!r:.80} cannot be measured: {why} Expected an expression, such as "
        "sim.state.x, max(sim.state.x) or hypot(x, y) - 1 m. (R1023)"
    )

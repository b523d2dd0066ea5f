"""Mistakes in an agent's code that only its steps show."""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import Protocol

from rems_net.agents.agent import Agent
from rems_net.agents.diagnosis import OWN
from rems_net.agents.runtime import runtime
from rems_net.defdict import DefDict
from rems_net.errors import SchemaError
from rems_net.events import warn
from rems_net.maths.draws import Draws

#: Number of Outs that were never set and are named; more are counted.
SHOWN = 5


def refuse_returned(agent: Agent, returned: object) -> None:
    """Raise SchemaError if a step returned a value that it should have set."""
    if inspect.isgenerator(returned) or inspect.iscoroutine(returned):
        returned.close()
        word = "yield" if inspect.isgenerator(returned) else "async"
        name = OWN.get(agent.kind, "step")
        raise SchemaError(
            f"{type(agent).__name__}.{name} has {word!r}, so nothing in it is done; "
            f"write `def {name}(self, tick)` without {word!r}. (R0502)"
        )
    if isinstance(returned, Mapping | DefDict):
        first = next(iter(agent.outs()), "")
        own = "" if first else ", such as value = Out(Schema(...))"
        raise SchemaError(
            f"{type(agent).__name__}.step returned {returned!r:.60}, which goes "
            f"nowhere; set its Out{own}: self.{first or 'value'} = {returned!r:.60} "
            "(R0503)"
        )


@cache
def refusal(port: str, robot: bool) -> Callable[[str], SchemaError]:
    """Return a function that makes the error of setting a field of an In.

    The function takes the field's path. robot: whether the In is a robot's.
    """
    instead = "engine.put(key, {...}) commands a robot" if robot else "write to an Out"

    def refuse(path: str) -> SchemaError:
        return SchemaError(
            f"{path!r} of {port!r} is set, and {port} is an In: its value is another "
            f"agent's, and can only be read; {instead}, or copy it: "
            f"mine = self.{port}.copy() (R0506)"
        )

    return refuse


def odd_glob(source: str, keys: Sequence[str], one: bool) -> str:
    """Return a warning of a glob that matches no ports, or too many; else "".

    keys: of the ports.  one: whether its In has a schema, and so reads one port.
    """
    if not keys:
        return f"reads {source!r}, which matches nothing yet."
    # A check refuses it; on an open fabric, agents come later.
    return (
        f"has a schema, so it reads one port, and {source!r} matches {len(keys)}, "
        f"{keys[0]} and {keys[1]} among them: it takes what comes last. Name one."
        if one
        else ""
    )


def never_set(agents: Iterable[Agent]) -> str:
    """Return a warning of the Outs that no step has set; "" if there are none."""
    never = [
        f"{agent.key} never set {port!r}"
        for agent in agents
        if agent.kind not in ("robot", "world") and runtime(agent).tick.n
        for port in agent.outs()
        if port not in runtime(agent).written
    ]
    more = f", and {len(never) - SHOWN} more" if len(never) > SHOWN else ""
    end = "; who reads it saw its default"
    return f"{', '.join(never[:SHOWN])}{more}{end}" if never else ""


class Totals(Protocol):
    """Counter of dropped values: an In of an engine."""

    def total(self) -> None:
        """Warn how many, and why."""


def sum_up(
    agents: Iterable[Agent],
    inlets: Iterable[Totals],
    draws: Draws,
    name: str,
    *,
    failed: bool,
) -> None:
    """Warn of mistakes of an engine's agents that are known only at the end.

    These are: Outs that were never set, random numbers without a seed, and dropped
    values. name: of the process that draws random numbers.
    """
    if not failed and (never := never_set(agents)):
        warn("unset", never)
    for sentence in draws.told(name):
        warn("differs", sentence)
    for inlet in inlets:
        inlet.total()

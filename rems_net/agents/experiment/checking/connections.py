"""Connections: what every In reads, checked before anything starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rems_net.agents.agent import Agent
from rems_net.defdict import Schema
from rems_net.engine.wiring import Entry, Written, resolve
from rems_net.errors import ExperimentError


def written(agents: Mapping[str, Agent]) -> dict[str, Entry]:
    """What each of these agents writes, as a roster will say it."""
    return {key: Entry.of(agent) for key, agent in agents.items()}


def check_connections(
    agent: Agent,
    sources: Mapping[str, str],
    entries: Mapping[str, Entry],
    agents: Mapping[str, Agent],
) -> None:
    """Find what every In of `agent` reads, and settle or convert its schema.

    sources: In to what it is connected to. Raises ExperimentError or ConversionError.
    """
    own = agent.schemas()
    for port in agent.ins():
        source = sources.get(port)
        if source is None:
            if agent.kind != "robot":  # a robot may be told by any program
                raise ExperimentError(
                    f"its In {port!r} is connected to nothing; say where it reads, "
                    f"such as {port}='robot/sim/state'."
                )
            continue
        many = "*" in source
        found = resolve(source, entries, f"{agent.key}.{port}", agent.key)
        if port not in own:
            if not many:  # it has one source, and so its schema
                agent.settle(port, _schema(found[0], agents))
            continue
        if len(found) > 1:
            instead = ", or leave the schema out: In() takes all that match"
            raise ExperimentError(
                f"its In {port!r} has a schema, so it reads one port, and {source!r} "
                f"matches {len(found)}: {_named(found)}. Name one of them"
                f"{'' if agent.kind == 'robot' else instead}."
            )
        for one in found:
            _schema(one, agents).converter(
                own[port], source_label=one.key, target_label=f"{agent.key}/{port}"
            )


def _schema(source: Written, agents: Mapping[str, Agent]) -> Schema:
    return agents[source.entry.key].schemas()[source.port]


def _named(found: Sequence[Written]) -> str:
    keys = [one.key for one in found]
    if len(keys) > 4:
        return f"{', '.join(keys[:3])} and {len(keys) - 3} more"
    return f"{', '.join(keys[:-1])} and {keys[-1]}"

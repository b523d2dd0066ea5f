"""Connections: what every In reads, checked before anything starts."""

from __future__ import annotations

from collections.abc import Mapping

from rems_net.agents.agent import Agent
from rems_net.agents.protocol.roster import Entry, resolve
from rems_net.errors import ExperimentError


def written(agents: Mapping[str, Agent]) -> dict[str, Entry]:
    """What each of these agents writes, as a roster will say it."""
    return {
        key: Entry(key, key, {p: s.digest for p, s in agent.published().items()})
        for key, agent in agents.items()
    }


def check_connections(
    agent: Agent,
    sources: Mapping[str, str],
    entries: Mapping[str, Entry],
    agents: Mapping[str, Agent],
) -> None:
    """Find what every In of `agent` reads, and convert it.

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
        for found in resolve(source, entries, f"{agent.key}.{port}"):
            if port in own and found.entry.key != agent.key:
                schema = agents[found.entry.key].schemas()[found.port]
                schema.converter(
                    own[port],
                    source_label=found.key,
                    target_label=f"{agent.key}/{port}",
                )

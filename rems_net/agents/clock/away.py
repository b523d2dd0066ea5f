"""Away: for whom on other machines a run waits, and what brings them."""

from __future__ import annotations

from collections.abc import Collection

from rems_net.agents.protocol.terms import Terms
from rems_net.errors import AgentError

#: agents that are named
MOST = 6


class Away:
    """The hosts of these terms that are started on other machines."""

    def __init__(self, terms: Terms):
        self._terms = terms
        self._told: set[str] = set()

    def news(self, missing: Collection[str]) -> str:
        """For whom of `missing` it waits, where that is news: another machine came."""
        terms, found = self._terms, dict[str, list[str]]()
        for host in sorted(missing):
            if host not in terms.tickets:
                keys = found.setdefault(terms.machines.get(host, ""), [])
                keys += sorted(terms.hosts[host])
        if found.keys() == self._told:
            return ""
        self._told = set(found)
        parts = [_describe(machine, keys) for machine, keys in sorted(found.items())]
        return f"waiting for {'; '.join(parts)}" if parts else ""

    def never_came(self, missing: Collection[str], seconds: float) -> AgentError:
        """The error for the first of those that did not come in time."""
        first = min(missing)
        if machine := self._terms.machines.get(first):
            return AgentError(
                min(self._terms.hosts[first]),
                f"machine {machine} did not bring it within {seconds:.0f} s; type "
                f"there: rems bring --as {machine}",
            )
        return AgentError(first, f"did not join within {seconds:.0f} s of the last")


def _describe(machine: str, keys: list[str]) -> str:
    more = f" and {len(keys) - MOST} more" if len(keys) > MOST else ""
    named = f"{', '.join(keys[:MOST])}{more}"
    if not machine:
        return named
    return f"machine {machine}: {named} (on it: rems bring --as {machine})"

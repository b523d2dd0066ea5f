"""Opening: how a clock takes over a fabric, and waits for its hosts."""

import os
from collections.abc import Callable, Collection

from rems_net.agents.protocol.alike import tell_version
from rems_net.agents.protocol.terms import Terms
from rems_net.errors import AgentError, FabricError, some
from rems_net.router.find import VARIABLE
from rems_net.router.mail import Question
from rems_net.router.message import pack
from rems_net.router.session import Session

#: s. Another clock, or a keeper of STOP, answers within this time.
ANSWER_TIMEOUT = 0.5
#: Number of agents that are named when the clock waits for them.
MOST = 6


def become_clock(
    session: Session,
    run: int,
    watch: Callable[[], None],
    tell_age: Callable[[Question], None],
) -> None:
    """Make this session the clock of `run`: subscribe (`watch`), and answer.

    Raises FabricError if there is another clock already.
    """
    key = session.key
    if session.who(key("clock", "@alive")):
        raise _taken(session)
    session.present(key("clock", "@alive"))
    session.present(key("clock", "@run", str(run)))
    watch()
    session.answer_at_once(key("clock", "@age"), tell_age)
    session.answer_at_once(key("clock", "@version"), tell_version(session))
    # Of two clocks that start in the same instant, at least one sees the other.
    if len(session.ask(key("clock", "@age"), timeout=ANSWER_TIMEOUT)) > 1:
        raise _taken(session)


def stop_holds(session: Session) -> bool:
    """Return whether a router or a host answers that STOP holds."""
    answers = session.ask(session.key("stop", "@holds"), timeout=ANSWER_TIMEOUT)
    return any(mail.payload == pack(True) for mail in answers)


def _taken(session: Session) -> FabricError:
    way = "type rems router forget to run it on your laptop alone"
    if os.environ.get(VARIABLE):
        way = f"unset {VARIABLE}"
    return FabricError(
        f"The fabric {session.fabric!r} has a clock already: another experiment runs "
        f"at {session.link.endpoint}. Wait for its end, give this one a fabric of its "
        f"own (--fabric NAME), or {way}. (R0603)"
    )


class Away:
    """The hosts of these terms that are started on other machines."""

    def __init__(self, terms: Terms):
        self._terms = terms
        self._told: set[str] = set()

    def news(self, missing: Collection[str]) -> str:
        """Return a sentence with the missing hosts, if it is news."""
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

    def never_came(
        self, missing: Collection[str], seconds: float, *, ended: bool = False
    ) -> AgentError:
        """Return the error for the first of those that did not come in time.

        ended: whether the run was ended meanwhile.
        """
        # A host of another machine is more likely the missing one.
        first = min(missing, key=lambda host: (host in self._terms.tickets, host))
        if ended:
            key = min(self._terms.hosts[first])
            return AgentError(key, "had not come yet when the run was ended (R0521)")
        if machine := self._terms.machines.get(first):
            return AgentError(
                min(self._terms.hosts[first]),
                f"machine {machine} did not bring it within {seconds:.0f} s; type "
                f"there: rems agent bring --as {machine} (R0521)",
            )
        return AgentError(
            first, f"did not join within {seconds:.0f} s of the last (R0521)"
        )


def _describe(machine: str, keys: list[str]) -> str:
    named = some(keys, MOST)
    if not machine:
        return named
    return f"machine {machine}: {named} (on it: rems agent bring --as {machine})"

"""Members: the hosts of a run, each in one of the states of this table.

| state | the host | next state |
|---|---|---|
| (expected) | is in the terms, and has not come: it is no member yet | unseen |
| unseen | shows no liveliness token: just admitted, cut off | seen, crashed, gone |
| seen | shows its token | unseen, crashed, gone |
| crashed | is started again, after a pause | unseen, gone |
| gone | has left, or was given up | unseen: on an open fabric it may come again |

`admission.py` moves members from state to state. A member that has not done a tick is
late, in any
state: `progress.py`.
"""

import time
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from math import inf
from typing import Any

from rems_net.agents.about.wiring import Entry
from rems_net.agents.protocol.alike import FIRMWARE, unlike
from rems_net.agents.protocol.badge import MEMBERS, badge_of
from rems_net.agents.protocol.messages import Request
from rems_net.agents.protocol.terms import Terms
from rems_net.errors import ExperimentError, some

#: s. A rate is counted over at least this time, and at most twice as long.
WINDOW = 1.0


class State(Enum):
    """State of a member; see the table above."""

    UNSEEN = auto()
    SEEN = auto()
    CRASHED = auto()
    GONE = auto()


@dataclass(eq=False)
class Member:
    """One host: its machine, its agents, and the last tick it has done.

    badge: the number that its messages carry
    first: the first tick that it receives;
    n: the newest tick it has done
    entries: its agents; none once it is released, crashed or gone
    """

    badge: int
    name: str
    machine: str
    pid: int
    closing: str
    entries: list[Entry]
    first: int = 1
    n: int = 0
    seen: float = 0.0
    #: (s, tick) of two earlier moments; its rate is counted from the older one
    marks: tuple[tuple[float, int], ...] = ()
    made: list[str] = field(default_factory=list)
    #: code line at which it stood when it held up a tick
    stands: str = ""
    #: the libraries and processor that it computes with
    numerics: str = ""
    #: an agent that lives there, or the host's own name
    agent: str = ""
    state: State = State.UNSEEN
    #: why it was given up, or crashed
    cause: str = ""
    #: number of its crashes, and time of the last one; 0.0 once it is back
    crashes: int = 0
    since: float = 0.0
    #: time when it is given up, if it is unseen or crashed
    until: float = 0.0
    #: time when its process is started again, if it has crashed; 0.0 once it is
    due: float = 0.0
    #: whether the other hosts wait for it, if it has crashed
    awaited: bool = False

    def __post_init__(self) -> None:
        #: the tick from which on the others wait for it
        self.begins = min((e.since for e in self.entries if e.lockstep), default=inf)

    @property
    def left(self) -> bool:
        """Whether it does not take part now."""
        return self.state in (State.CRASHED, State.GONE)

    def hear(self, n: int) -> None:
        """Note that it has done tick `n`, now."""
        self.n, self.seen = n, time.monotonic()
        if not self.marks or self.seen - self.marks[-1][0] > WINDOW:
            self.marks = (*self.marks[-1:], (self.seen, n))

    def rate(self, now: float) -> float:
        """Return its ticks per second [Hz]; 0.0 once it has done none for a while."""
        since, first = self.marks[0] if self.marks else (now, self.n)
        # Windows' clock has steps of 16 ms: ticks of one step have no rate.
        if self.n == first or self.seen == since:
            return 0.0
        rate = (self.n - first) / (self.seen - since)
        return rate if now - self.seen < WINDOW + 3 / rate else 0.0

    def describe(self) -> str:
        """Return its agents and its machine: `robot/a, robot/b and 3 more on desk`."""
        names = [e.key for e in self.entries] or [self.name]
        return f"{some(names, 3)} on {self.machine}"

    def owes(self, n: int) -> bool:
        """Return whether it has yet to do tick n, or one before."""
        return self.n < n and bool(self.entries) and self.begins <= n


class Members:
    """All hosts that have ever joined a run of these terms, by name."""

    def __init__(self, run: int, terms: Terms) -> None:
        self.run, self.terms = run, terms
        self.all: dict[str, Member] = {}
        #: members that have not left
        self.by_badge: dict[int, Member] = {}
        #: the port (`robot/sim/state`) whose value ends a host's tick -> host
        self.closing: dict[str, Member] = {}
        self.schemas: dict[str, bytes] = {}
        #: whether the roster is not up to date
        self.changed = True
        self._count = 0

    def present(self) -> list[Member]:
        """Return the members that have not left."""
        return [m for m in self.all.values() if not m.left]

    def owner(self, key: str) -> Member | None:
        """Return the member in which the agent `key` lives; None if it is not here."""
        for member in self.present():
            if any(e.key == key for e in member.entries):
                return member
        return None

    def gone(self) -> dict[str, str]:
        """Return, by host, why it crashed or was given up."""
        return {m.name: m.cause for m in self.all.values() if m.cause}

    def join(self, request: Request, n: int, now: float) -> Member:
        """Admit a host from tick n on (or later, if an agent's `since` is later).

        Raises ExperimentError for an agent whose name is taken, or that is not
        expected.
        """
        before = self.all.get(request.host)
        here = before if before is not None and not before.left else None
        who = request.machine, request.pid
        if here is not None and (here.machine, here.pid) == who:
            # It asks again: the first answer was lost, or the clock was out of sight
            # for a while. On an open fabric the ticks of that while are past.
            if self.terms.open:
                here.first, self.changed = n, True
            return here
        taken = {e.key: m for m in self.present() for e in m.entries}
        for entry in request.agents:
            if entry.key in taken:
                raise ExperimentError(
                    f"there is a {entry.key} already, on {taken[entry.key].machine}; "
                    "give this one another name. (R0445)"
                )
        if here is not None:
            raise ExperimentError(
                f"there is a host {here.name!r} already, on {here.machine}; give "
                "this one another name. (R0445)"
            )
        self._check_expected(request, before)
        if self.terms.open and any(entry.lockstep for entry in request.agents):
            raise ExperimentError(
                "this fabric is open, and its clock does not wait for hosts; bring "
                f"{request.agents[0].key} by: rems agent start (R0445)"
            )
        if self._count >= MEMBERS - 1:
            raise ExperimentError(
                "this run has had as many members as it can have; start a new run."
                " (R0445)"
            )
        self._count += 1
        badge = badge_of(self.run, self._count)
        member = Member(
            badge,
            request.host,
            request.machine,
            request.pid,
            request.closing,
            [replace(e, since=max(n, e.since), badge=badge) for e in request.agents],
            first=n,
            seen=now,
            numerics=request.numerics,
            agent=request.agents[0].key if request.agents else request.host,
        )
        if before is not None:
            member.crashes = before.crashes
            if before.state is State.CRASHED:
                member.since, before.state = before.since, State.GONE
        self.all[member.name] = self.by_badge[badge] = member
        self.schemas.update(request.schemas)
        if member.closing:
            self.closing[member.closing] = member
        self.changed = True
        return member

    def _check_expected(self, request: Request, before: Member | None) -> None:
        terms = self.terms
        if not terms.hosts:
            return
        if before is not None and before.state is State.GONE and before.cause:
            raise ExperimentError(
                f"{request.host} was given up: {before.cause}. (R0445)"
            )
        keys = frozenset(entry.key for entry in request.agents)
        if terms.hosts.get(request.host) != keys:
            away = sorted(terms.hosts.keys() - self.all.keys())
            raise ExperimentError(
                f"this run is closed, and has no place for {', '.join(sorted(keys))}; "
                f"it waits for {', '.join(away) or 'no host'}. (R0445)"
            )
        if terms.tickets.get(request.host, request.ticket) != request.ticket:
            raise ExperimentError(
                f"{request.host} is started by this run itself; to bring it from "
                f'another machine, write machine = "b" at it. (R0445)'
            )
        for entry in request.agents:
            for port, here in terms.outs.get(entry.key, {}).items():
                if entry.outs.get(port, here.digest) != here.digest:
                    there = request.schemas[entry.outs[port]]
                    board = request.numerics.startswith(FIRMWARE)
                    name = request.machine
                    raise unlike(entry.key, port, here, there, name, board=board)

    def awaited(self) -> list[str]:
        """Return the keys of the expected agents that have not come yet."""
        away = self.terms.hosts.keys() - self.all.keys()
        return sorted(key for host in away for key in self.terms.hosts[host])

    def ticket_of(self, ticket: int) -> str | None:
        """Return the host that was started here with this ticket."""
        tickets = self.terms.tickets.items()
        found = [host for host, one in tickets if one == ticket]
        return found[0] if found and ticket else None

    def drop(self, member: Member, cause: str = "", state: State = State.GONE) -> None:
        """Remove a host that has left, crashed, or is given up because of `cause`."""
        member.state, member.entries = state, []
        member.cause = cause or member.cause
        self.by_badge.pop(member.badge, None)
        self.closing.pop(member.closing, None)
        self.changed = True

    def forget(self, member: Member) -> None:
        """Remove a host that has left before the run began, and may come again."""
        self.drop(member)
        del self.all[member.name]

    def release(self) -> None:
        """End every membership; start no host again."""
        for member in self.all.values():
            member.entries = []
            if member.state is State.CRASHED:
                member.state, member.cause = State.GONE, ""
        self.changed = True

    def status(self) -> list[dict[str, Any]]:
        """Return, for each agent: agent, kind, host, rate [Hz], seen [s ago], tick."""
        now = time.monotonic()
        return [
            {
                "agent": entry.key,
                "kind": entry.kind,
                "host": f"{member.machine}:{member.pid}",
                "rate": member.rate(now) / entry.every,
                "seen": now - member.seen,
                "tick": member.n,
            }
            for member in self.present()
            for entry in member.entries
        ]

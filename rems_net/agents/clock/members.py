"""Members: the hosts of a run, each in one of the states of this table.

| state | the host | next state |
|---|---|---|
| (expected) | is in the terms, and has not come: it is no member yet | unseen |
| unseen | shows no liveliness token: let in just now, cut off | seen, crashed, gone |
| seen | shows its token | unseen, crashed, gone |
| crashed | is started again, after a pause | unseen, gone |
| gone | has left, or was given up | unseen: on an open fabric it may come anew |

`attendance.py` moves members from state to state. A member that has not done a tick is
late, whatever its state is: `progress.py`.
"""

import time
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from typing import Any

from rems_net.agents.protocol.alike import FIRMWARE, unlike
from rems_net.agents.protocol.badge import MEMBERS, badge_of
from rems_net.agents.protocol.messages import Request
from rems_net.agents.protocol.terms import Terms
from rems_net.engine.wiring import Entry
from rems_net.errors import ExperimentError

#: s. Rates are of this time, and of up to twice as long.
WINDOW = 1.0


class State(Enum):
    """What the clock knows of a member; see the table above."""

    UNSEEN = auto()
    SEEN = auto()
    CRASHED = auto()
    GONE = auto()


@dataclass(eq=False)
class Member:
    """One host: where it runs, what lives in it, and the last tick it has done.

    badge: what its messages carry
    first: the tick from which on it hears; n: the newest it has done
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
    #: (s, tick) of some ticks ago: from the older one its rate is counted
    marks: tuple[tuple[float, int], ...] = ()
    made: list[str] = field(default_factory=list)
    #: where its code stood when it held a tick
    stands: str = ""
    #: what it computes with
    numerics: str = ""
    #: an agent that lives there, or the host itself
    agent: str = ""
    state: State = State.UNSEEN
    #: why it was given up, or crashed
    cause: str = ""
    #: how often it has crashed, and when it did last; 0.0 once it is back
    crashes: int = 0
    since: float = 0.0
    #: if it is unseen or crashed: when it is given up
    until: float = 0.0
    #: if it has crashed: when its process is started again; 0.0 once it is
    due: float = 0.0
    #: if it has crashed: whether the others wait for it
    awaited: bool = False

    @property
    def left(self) -> bool:
        """Whether it takes no part now."""
        return self.state in (State.CRASHED, State.GONE)

    def hear(self, n: int) -> None:
        """Take in that it has done tick `n`, now."""
        self.n, self.seen = n, time.monotonic()
        if not self.marks or self.seen - self.marks[-1][0] > WINDOW:
            self.marks = (*self.marks[-1:], (self.seen, n))

    def rate(self, now: float) -> float:
        """Return how many ticks [Hz] it does; 0.0 once it has done none for a while."""
        since, first = self.marks[0] if self.marks else (now, self.n)
        if self.n == first:
            return 0.0
        rate = (self.n - first) / (self.seen - since)
        return rate if now - self.seen < WINDOW + 3 / rate else 0.0

    def describe(self) -> str:
        """What lives there, and where: `robot/a, robot/b and 3 more on desk`."""
        names = [e.key for e in self.entries] or [self.name]
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        return f"{', '.join(names[:3])}{more} on {self.machine}"

    def owes(self, n: int) -> bool:
        """Whether it has yet to do tick n, or one before."""
        return self.n < n and any(e.lockstep and e.since <= n for e in self.entries)


class Members:
    """All hosts that have ever joined a run of these terms, by name."""

    def __init__(self, run: int, terms: Terms) -> None:
        self.run, self.terms = run, terms
        self.all: dict[str, Member] = {}
        #: those that are here
        self.by_badge: dict[int, Member] = {}
        #: the port (`robot/sim/state`) whose value ends a host's tick -> host
        self.closing: dict[str, Member] = {}
        self.schemas: dict[str, bytes] = {}
        #: whether the roster is not up to date
        self.changed = True
        self._count = 0

    def present(self) -> list[Member]:
        """Those that have not left."""
        return [m for m in self.all.values() if not m.left]

    def owner(self, key: str) -> Member | None:
        """The member in which the agent `key` lives, if it is here."""
        for member in self.present():
            if any(e.key == key for e in member.entries):
                return member
        return None

    def gone(self) -> dict[str, str]:
        """Why hosts are not here any more that crashed or were given up."""
        return {m.name: m.cause for m in self.all.values() if m.cause}

    def join(self, request: Request, n: int, now: float) -> Member:
        """Take in a host from tick n on (or later, where an agent says so).

        Raises ExperimentError for an agent whose name is taken, or whom nobody expects.
        """
        before = self.all.get(request.host)
        here = before if before is not None and not before.left else None
        who = request.machine, request.pid
        if here is not None and (here.machine, here.pid) == who:
            return here  # it asks again: the first answer was lost
        taken = {e.key: m for m in self.present() for e in m.entries}
        for entry in request.agents:
            if entry.key in taken:
                raise ExperimentError(
                    f"there is a {entry.key} already, on {taken[entry.key].machine}; "
                    "give this one another name."
                )
        if here is not None:
            raise ExperimentError(
                f"there is a host {here.name!r} already, on {here.machine}; give "
                "this one another name."
            )
        self._check_expected(request, before)
        if self.terms.open and any(entry.lockstep for entry in request.agents):
            raise ExperimentError(
                "this fabric is open, and its clock waits for nobody; bring "
                f"{request.agents[0].key} by `rems agent start`."
            )
        if self._count >= MEMBERS - 1:
            raise ExperimentError("this run has had all the members it can have.")
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
            raise ExperimentError(f"{request.host} was given up: {before.cause}.")
        keys = frozenset(entry.key for entry in request.agents)
        if terms.hosts.get(request.host) != keys:
            away = sorted(terms.hosts.keys() - self.all.keys())
            raise ExperimentError(
                f"this run is closed, and has no place for {', '.join(sorted(keys))}; "
                f"it waits for {', '.join(away) or 'nobody'}."
            )
        if terms.tickets.get(request.host, request.ticket) != request.ticket:
            raise ExperimentError(
                f"{request.host} is started by this run itself; to bring it from "
                f'another machine, write machine = "b" at it.'
            )
        for entry in request.agents:
            for port, here in terms.outs.get(entry.key, {}).items():
                if entry.outs.get(port, here.digest) != here.digest:
                    there = request.schemas[entry.outs[port]]
                    board = request.numerics.startswith(FIRMWARE)
                    name = request.machine
                    raise unlike(entry.key, port, here, there, name, board=board)

    def awaited(self) -> list[str]:
        """The agents that are expected, and have not come yet."""
        away = self.terms.hosts.keys() - self.all.keys()
        return sorted(key for host in away for key in self.terms.hosts[host])

    def ticket_of(self, ticket: int) -> str | None:
        """The host that was started here with this ticket."""
        tickets = self.terms.tickets.items()
        found = [host for host, one in tickets if one == ticket]
        return found[0] if found and ticket else None

    def drop(self, member: Member, cause: str = "", state: State = State.GONE) -> None:
        """This host has left, has crashed, or is given up because of `cause`."""
        member.state, member.entries = state, []
        member.cause = cause or member.cause
        self.by_badge.pop(member.badge, None)
        self.closing.pop(member.closing, None)
        self.changed = True

    def forget(self, member: Member) -> None:
        """This host has left before the run began, and may come again."""
        self.drop(member)
        del self.all[member.name]

    def release(self) -> None:
        """Nobody takes part any more, and nobody is started again."""
        for member in self.all.values():
            member.entries = []
            if member.state is State.CRASHED:
                member.state, member.cause = State.GONE, ""
        self.changed = True

    def status(self) -> list[dict[str, Any]]:
        """Who is here: agent, kind, host, rate [Hz] of now, seen [s ago], tick."""
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

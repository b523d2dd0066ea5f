"""Membership: the hosts on a fabric, as its clock knows them."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from rems_net.agents.protocol.alike import FIRMWARE, unlike
from rems_net.agents.protocol.badge import MEMBERS, badge_of
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.messages import Request
from rems_net.agents.protocol.roster import Roster
from rems_net.defdict import Schema
from rems_net.engine.wiring import Entry
from rems_net.errors import ExperimentError

#: hosts that are named where more of them hold a tick
SHOWN = 3


@dataclass
class Member:
    """One host: where it runs, what lives in it, and the last tick it has done.

    badge: what its messages carry
    first: the tick from which on it hears; n: the newest it has done
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
    left: bool = False
    made: list[str] = field(default_factory=list)
    #: where its code stood when it held a tick
    stands: str = ""
    #: what it computes with
    numerics: str = ""
    #: the fabric that it is lent to
    lent: str = ""

    @property
    def agent(self) -> str:
        """An agent that lives there, or the host itself where none does any more."""
        return self.entries[0].key if self.entries else self.name

    def describe(self) -> str:
        """What lives there, and where: `robot/a, robot/b and 3 more on desk`."""
        names = [e.key for e in self.entries] or [self.name]
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        return f"{', '.join(names[:3])}{more} on {self.machine}"

    def owes(self, n: int) -> bool:
        """Whether it has yet to do tick n, or one before."""
        return self.n < n and any(e.lockstep and e.since <= n for e in self.entries)


class Membership:
    """All hosts that have ever joined, and the roster that follows from them.

    expected: the agents of each host that may join; empty where everybody may.
    tickets: what those of them prove themselves with that were started here.
    outs: of others, the ports as they are defined here.
    open: nobody is waited for, so nobody may ask for it.
    """

    def __init__(
        self,
        run: int = 0,
        expected: Mapping[str, frozenset[str]] | None = None,
        tickets: Mapping[str, int] | None = None,
        outs: Mapping[str, Mapping[str, Schema]] | None = None,
        *,
        open: bool = False,
    ) -> None:
        self.run, self._open = run, open
        self._expected, self._tickets = expected or {}, tickets or {}
        self._outs = outs or {}
        self.all: dict[str, Member] = {}
        #: those that are here
        self.by_badge: dict[int, Member] = {}
        #: why a host is not here any more, where it was given up
        self.gone: dict[str, str] = {}
        #: those of them that may come back: they are started again
        self.returning: set[str] = set()
        self._count = 0
        self.roster = Roster(0, 1, {}, {}, run)
        #: those that a tick which is not done may name
        self._rosters = deque([self.roster])
        #: the port (`robot/sim/state`) whose value ends a host's tick -> host
        self.closing: dict[str, Member] = {}
        self._schemas: dict[str, bytes] = {}
        self._changed = True
        #: the next tick at which somebody joins who is here already
        self._next = 1
        self._waited_for: set[str] = set()

    def present(self) -> list[Member]:
        """Those that have not left."""
        return [m for m in self.all.values() if not m.left]

    def owner(self, key: str) -> Member | None:
        """The member in which the agent `key` lives, if it is here."""
        for member in self.present():
            if any(e.key == key for e in member.entries):
                return member
        return None

    def join(self, request: Request, n: int, now: float) -> Member:
        """Take in a host from tick n on (or later, where an agent says so).

        Raises ExperimentError for an agent whose name is taken, or whom nobody expects.
        """
        known = self.all.get(request.host)
        if known is not None and known.left:
            known = None
        who = request.machine, request.pid
        if known is not None and (known.machine, known.pid) == who:
            return known  # it asks again: the first answer was lost
        taken = {e.key: m for m in self.present() for e in m.entries}
        for entry in request.agents:
            if entry.key in taken:
                raise ExperimentError(
                    f"there is a {entry.key} already, on {taken[entry.key].machine}; "
                    "give this one another name."
                )
        if known is not None:
            raise ExperimentError(
                f"there is a host {known.name!r} already, on {known.machine}; give "
                "this one another name."
            )
        self._check_expected(request)
        if self._open and any(entry.lockstep for entry in request.agents):
            raise ExperimentError(
                "this fabric is open, and its clock waits for nobody; bring "
                f"{request.agents[0].key} by `rems agent`."
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
        )
        self.all[member.name] = self.by_badge[badge] = member
        self.gone.pop(member.name, None)
        self.returning.discard(member.name)
        self._schemas.update(request.schemas)
        if member.closing:
            self.closing[member.closing] = member
        self._changed = True
        return member

    def _check_expected(self, request: Request) -> None:
        if not self._expected:
            return
        if request.host in self.gone and request.host not in self.returning:
            raise ExperimentError(
                f"{request.host} was given up: {self.gone[request.host]}."
            )
        keys = frozenset(entry.key for entry in request.agents)
        if self._expected.get(request.host) != keys:
            away = sorted(self._expected.keys() - self.all.keys())
            raise ExperimentError(
                f"this run is closed, and has no place for {', '.join(sorted(keys))}; "
                f"it waits for {', '.join(away) or 'nobody'}."
            )
        if self._tickets.get(request.host, request.ticket) != request.ticket:
            raise ExperimentError(
                f"{request.host} is started by this run itself; to bring it from "
                f"another machine, run with --elsewhere {request.host}."
            )
        for entry in request.agents:
            for port, here in self._outs.get(entry.key, {}).items():
                if entry.outs.get(port, here.digest) != here.digest:
                    there = request.schemas[entry.outs[port]]
                    raise unlike(
                        entry.key,
                        port,
                        here,
                        there,
                        request.machine,
                        board=request.numerics.startswith(FIRMWARE),
                    )

    def awaited(self) -> list[str]:
        """The agents that are expected, and have not come yet."""
        away = self._expected.keys() - self.all.keys()
        return sorted(key for host in away for key in self._expected[host])

    def ticket_of(self, ticket: int) -> str | None:
        """The host that was started here with this ticket."""
        found = [host for host, one in self._tickets.items() if one == ticket]
        return found[0] if found and ticket else None

    def drop(self, member: Member, cause: str = "") -> None:
        """This host has left, or is given up because of `cause`."""
        member.left = True
        member.entries = []
        if cause:
            self.gone[member.name] = cause
        self.by_badge.pop(member.badge, None)
        self.closing.pop(member.closing, None)
        self._changed = True

    def forget(self, member: Member) -> None:
        """This host has left before the run began, and may come again."""
        self.drop(member)
        del self.all[member.name]

    def release(self) -> None:
        """Nobody takes part any more."""
        for member in self.all.values():
            member.entries = []
        self._changed = True

    def update(self, n: int) -> bool:
        """Bring the roster up to tick n; True when it is a new one."""
        if not self._changed and n < self._next:
            return False
        self._changed = False
        every = [e for m in self.present() for e in m.entries]
        self._next = min((e.since for e in every if e.since > n), default=sys.maxsize)
        agents = {e.key: e for e in sorted(every, key=lambda e: e.key) if e.since <= n}
        used = {d for e in agents.values() for d in e.outs.values()}
        schemas = {d: s for d, s in sorted(self._schemas.items()) if d in used}
        epoch, gone = self.roster.epoch + 1, dict(self.gone)
        self.roster = Roster(epoch, n, agents, schemas, self.run, gone)
        self._rosters.append(self.roster)
        while len(self._rosters) > 1 and self._rosters[1].first < n - AHEAD:
            self._rosters.popleft()
        self._waited_for = {e.host for e in agents.values() if e.lockstep}
        return True

    def roster_of(self, epoch: str) -> Roster:
        """The roster of this epoch, in words; the newest where there is none."""
        found = [r for r in self._rosters if str(r.epoch) == epoch]
        return found[0] if found else self.roster

    def late(self, n: int) -> set[str]:
        """The hosts that are waited for and have not done tick n."""
        return {h for h in self._waited_for if self.all[h].owes(n)}

    def holders(self, pending: set[str]) -> list[Member]:
        """Of those that are late, the ones that do not wait for another late one."""
        late = {e.key: h for h in pending for e in self.all[h].entries}
        holding = {
            h
            for h in pending
            if not any(
                late.get(key, h) != h
                for e in self.all[h].entries
                for key in self.roster.writers(e)
            )
        }
        return [self.all[h] for h in sorted(holding or pending)]

    def describe_holders(self, pending: set[str]) -> str:
        """Who holds a tick, where, and where their code stands."""
        who = []
        holders = self.holders(pending)
        for member in holders[:SHOWN]:
            stands = f" ({member.stands})" if member.stands else ""
            who.append(f"{member.describe()}{stands}")
        if (more := len(holders) - SHOWN) > 0:
            who.append(f"{more} more host{'s' * (more > 1)}")
        return " and ".join(who)

    def status(self, elapsed: float, now: float) -> list[dict[str, Any]]:
        """Who is here: agent, kind, host, rate [Hz], seen [s ago], tick, lent."""
        return [
            {
                "agent": entry.key,
                "kind": entry.kind,
                "host": f"{member.machine}:{member.pid}",
                "rate": member.n / entry.every / elapsed if elapsed else 0.0,
                "seen": now - member.seen,
                "tick": member.n,
                "lent": member.lent,
            }
            for member in self.present()
            for entry in member.entries
        ]

"""Attendance: who is there, who is lost, and what a run does about that."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress

from rems_net.agents.clock.detector import Detector
from rems_net.agents.clock.membership import Member, Membership
from rems_net.agents.clock.pacing import Pacing
from rems_net.agents.clock.progress import Progress
from rems_net.agents.clock.restarts import Restarts
from rems_net.agents.protocol.limits import OVER_SAID
from rems_net.agents.protocol.messages import Farewell, Request
from rems_net.agents.protocol.terms import Terms
from rems_net.errors import AgentError
from rems_net.events import info, warn
from rems_net.maths.numerics import Platforms
from rems_net.router.session import Session

#: seconds between looks at what is not mail: dead processes, a held tick
LOOK = 0.05
#: seconds that nothing may be done in, when a run has failed
LAST = 2.0


class Attendance:
    """Lets members in, and takes in that they left, failed, crashed or are not seen.

    read: takes one letter of the clock's mail; whether one came in this time, s.
    say_roster: called when the others shall know at once that a member is gone.
    """

    def __init__(
        self,
        session: Session,
        terms: Terms,
        pacing: Pacing,
        members: Membership,
        progress: Progress,
        detector: Detector,
        restarts: Restarts,
        *,
        read: Callable[[float], bool],
        say_roster: Callable[[], None],
    ):
        self._session, self._terms, self._pacing = session, terms, pacing
        self._members, self._progress = members, progress
        self._detector, self._restarts = detector, restarts
        self._mail, self._say_roster = read, say_roster
        self._platforms = Platforms()
        #: whether everybody who was expected has come
        self.gathered = False

    def read(self, timeout: float = LOOK) -> None:
        """Take one letter, or find who is gone where none comes."""
        for member, error in self._detector.given_up():
            self._lose(member, error)
        if self._restarts.away:
            for host, agent, cause in self._restarts.look():
                self._give_up(host, AgentError(agent, cause))
        if not self._mail(timeout) and (died := self._detector.died()):
            if died[1].cause == OVER_SAID and not self._session.connected:
                raise self._cut_off()
            self._crash(*died)

    def _cut_off(self) -> AgentError:
        """Why a run ends whose hosts have waited for their router in vain."""
        at, patience = self._session.link.endpoint, self._terms.patience
        return AgentError(
            "clock", f"the router at {at} is out of sight for {patience:g} s"
        )

    def make_way(self, request: Request) -> None:
        """Who is out of sight gives his name to who comes.

        In an open fabric to anybody; in a closed one to himself, started again.
        """
        if not (self._terms.open or self._restarts.may(request.host)):
            return
        for entry in request.agents:
            owner = self._members.owner(entry.key)
            if owner is None or not self._detector.misses(owner.name):
                continue
            if self._terms.open:
                self._lose(owner, AgentError(entry.key, "has come anew"))
            elif owner.name == request.host:
                self._crash(owner, AgentError(entry.key, "its process was lost"))

    def welcome(self, member: Member) -> None:
        """A host is let in."""
        self._detector.expect(member)
        self._restarts.back(member.name, member.first)
        if self._terms.open:
            info("joined", f"{member.describe()} is here", member.agent)
            return
        # What others record is not repeated anyway.
        steps = any(entry.lockstep for entry in member.entries)
        numerics = member.numerics if steps else ""
        if news := self._platforms.news(member.describe(), numerics):
            warn("numerics", news, member.agent)

    def note_lent(self, member: Member, fabric: str) -> None:
        """A host is lent to another fabric, or back from it."""
        member.lent = fabric
        where = f"lent to {fabric!r}" if fabric else "back"
        info("lent", f"{member.describe()} is {where}", member.agent)

    def hear_farewell(self, member: Member | None, farewell: Farewell) -> None:
        """The last words of a host; of one that was never let in, if it is None."""
        error = AgentError(*farewell.failed) if farewell.failed else None
        if member is not None:
            member.made = list(farewell.made)
            self._detector.forget(member.name)
            self._crash(member, error)
        elif error is not None:
            early = self._members.ticket_of(farewell.badge)
            if early not in self._restarts.away:
                raise error
            self._crash(self._members.all[early], error)

    def _crash(self, member: Member, error: AgentError | None) -> None:
        """A member failed, or left in order; it is started again, or lost."""
        host, n = member.name, self._pacing.tick.n
        again = self._restarts.may(host)
        if host in self._restarts.away:
            if self._restarts.dies(host) or error is None:
                return
            away = self._restarts.away[host]
            if not again:
                del self._restarts.away[host]
                self._give_up(host, error)
                return
            when, agent, awaited = "as it started", away.agent, away.awaited
        else:
            if error is None or not again or not member.entries or self._terms.open:
                self._lose(member, error)
                return
            held = member.owes(n)
            when, agent = f"at tick {member.n + 1 if held else n}", member.agent
            awaited = any(entry.lockstep for entry in member.entries)
            self._members.returning.add(host)
            self._drop(member, error.cause)
        self._restarts.crashed(host, agent, when, error.cause, awaited=awaited)

    def _give_up(self, host: str, error: AgentError) -> None:
        """One that was to come back does not: it is dropped, or the run ends."""
        self._members.returning.discard(host)
        if not self._terms.drop:
            self._finish(self._pacing.tick.n)
            raise error
        info("dropped", f"{error}; dropped at tick {self._pacing.n}", error.agent)

    def _lose(self, member: Member, error: AgentError | None) -> None:
        """A member has left: by its release, or failing, which ends the run or not."""
        if self._terms.open:
            info("left", str(error or f"{member.describe()} has left"), member.agent)
            self._members.drop(member)
            self._detector.forget(member.name)
            return
        if (
            not self.gathered
            and member.name not in self._terms.tickets
            and member.entries
        ):
            left = f"{member.describe()} has left; it may come again"
            info("left", str(error or left), member.agent)
            self._members.forget(member)
            return
        going = bool(member.entries)
        held = member.owes(self._pacing.tick.n)
        if going and error is None:
            cause = f"left after tick {member.n}, before the end of the run"
            error = AgentError(member.agent, cause)
        if error is not None and not (self._terms.drop and going):
            self._members.drop(member, error.cause if going else "")
            if going:
                self._finish(member.n if held else self._pacing.tick.n)
            raise error
        if going and error is not None:
            n = member.n + 1 if held else self._pacing.tick.n
            info("dropped", f"{error}; dropped at tick {n}", error.agent)
        self._drop(member, error.cause if going and error else "")

    def _drop(self, member: Member, cause: str) -> None:
        """The run goes on without a member, from this tick on."""
        held = member.owes(self._pacing.tick.n)
        self._members.drop(member, cause)
        if held:
            # Those who wait for its values are told at once, by a roster without it.
            self._members.update(self._pacing.tick.n)
            self._say_roster()
        self._progress.forget(member.name)

    def _finish(self, n: int) -> None:
        """The run has failed: let the others do what was done up to the failure."""
        progress = self._progress
        progress.look()
        deadline = time.monotonic() + LAST
        while (done := progress.advance(n)) < n and time.monotonic() < deadline:
            with suppress(AgentError):  # the first failure is the one to tell
                self.read()
            if progress.done > done:
                deadline = time.monotonic() + LAST

"""Admissions: how members come, disappear and crash, and how a run reacts to that."""

import time
from collections.abc import Callable
from contextlib import suppress

from rems_net.agents.clock.members import Member, Members, State
from rems_net.agents.clock.pacing import Pacing
from rems_net.agents.clock.progress import Progress
from rems_net.agents.protocol.limits import OVER_SAID, backoff
from rems_net.agents.protocol.messages import Farewell, Request
from rems_net.errors import AgentError, uncoded
from rems_net.events import info, warn
from rems_net.maths.numerics import Platforms
from rems_net.router.session import Session

#: s. Time between two checks for dead processes and held ticks.
LOOK = 0.05
#: s. If a failed run makes no progress for this long, it ends.
LAST = 2.0


class Admissions:
    """Moves members through the table of `members.py`.

    look: raises AgentError for a process that has died.  lives: returns whether the
    process of a host is known to live.  start: starts the process of a host again.
    read: takes one letter of the clock's mail; returns whether one came in this time
    [s].
    say_roster: publishes the roster at once when a member is gone.
    """

    def __init__(
        self,
        session: Session,
        pacing: Pacing,
        members: Members,
        progress: Progress,
        *,
        look: Callable[[], None],
        lives: Callable[[str], bool],
        start: Callable[[str], None],
        read: Callable[[float], bool],
        say_roster: Callable[[], None],
    ):
        self.session, self.pacing, self._terms = session, pacing, members.terms
        self.members, self.progress = members, progress
        self._look, self._lives, self._start = look, lives, start
        self._mail, self._say_roster = read, say_roster
        self._platforms = Platforms()
        #: all members that are unseen or crashed, and some that were
        self._doubtful: set[Member] = set()
        #: whether all expected hosts have come
        self.gathered = False

    def read(self, timeout: float = LOOK) -> None:
        """Take one letter; if there is none, look for processes that have died."""
        if self._doubtful:
            self._look_after(time.monotonic())
        if self._mail(timeout):
            return
        try:
            self._look()
        except AgentError as error:
            member = self.members.all.get(error.agent)
            if member is None:  # it never joined
                raise
            # its farewell has reported the failure already
            if member.state is State.GONE:
                return
            if error.cause.startswith(OVER_SAID) and not self.session.connected:
                raise self._cut_off() from None
            self._crash(member, error)

    def awaited(self) -> bool:
        """Return whether a member for which the others wait has crashed."""
        return any(m.awaited and m.state is State.CRASHED for m in self._doubtful)

    def _look_after(self, now: float) -> None:
        """Give up members that are unseen for too long; start crashed ones again."""
        patience = self._terms.wait.back
        for member in [*self._doubtful]:
            if member.state is State.UNSEEN and now > member.until:
                # Without the router every member is out of sight.
                if self._lives(member.name) or not self.session.connected:
                    member.until = now + patience
                    continue
                cause = (
                    f"is out of sight on {member.machine} for {patience:g} s (R0522)"
                )
                self._lose(member, AgentError(member.agent, cause))
            elif member.state is State.CRASHED and member.due and now >= member.due:
                member.due = 0.0
                self._start(member.name)
            elif member.state is State.CRASHED and now > member.until:
                cause = f"did not come back within {patience:g} s of its crash (R0522)"
                self._give_up(member, AgentError(member.agent, cause))
            elif member.state in (State.SEEN, State.GONE):
                self._doubtful.discard(member)

    def _cut_off(self) -> AgentError:
        """Return the error of a run whose hosts waited for their router in vain."""
        at, patience = self.session.link.endpoint, self._terms.wait.back
        return AgentError(
            "clock", f"the router at {at} is out of sight for {patience:g} s (R0522)"
        )

    def make_way(self, request: Request) -> None:
        """Free the names that a newcomer wants of a host that is out of sight.

        On an open fabric any host may take the name; in a closed run only the same
        host, after a restart.
        """
        for entry in request.agents:
            owner = self.members.owner(entry.key)
            if owner is None or owner.state is not State.UNSEEN:
                continue
            if self._terms.open:
                self._lose(owner, AgentError(entry.key, "has come anew"))
            elif owner.name == request.host and self._may_restart(owner):
                self._crash(owner, AgentError(entry.key, "its process was lost"))

    def welcome(self, member: Member) -> None:
        """Note that a host is admitted; it must come into sight in time."""
        self._expect(member)
        if member.since:
            text = f"{member.agent} is back from tick {member.first} on, after "
            text += f"{time.monotonic() - member.since:.1f} s"
            info("back", text, member.agent)
            member.since = 0.0
        if self._terms.open:
            info("joined", f"{member.describe()} is here", member.agent)
            return
        # The recordings of free-running agents cannot be repeated anyway.
        steps = any(entry.lockstep for entry in member.entries)
        numerics = member.numerics if steps else ""
        if news := self._platforms.news(member.describe(), numerics):
            warn("numerics", news, member.agent)

    def notice(self, badge: int, alive: bool) -> None:
        """Note that a member came into sight, or went out of it."""
        member = self.members.by_badge.get(badge)
        if member is not None and alive:
            member.state = State.SEEN
        elif member is not None:
            self._expect(member)

    def _expect(self, member: Member) -> None:
        if member.state is not State.UNSEEN or not member.until:
            member.state = State.UNSEEN
            member.until = time.monotonic() + self._terms.wait.back
            self._doubtful.add(member)

    def hear_farewell(self, member: Member | None, farewell: Farewell) -> None:
        """Take in the farewell of a host; `member` is None if it was never admitted."""
        error = AgentError(*farewell.failed) if farewell.failed else None
        if member is not None:
            member.made = list(farewell.made)
            self._crash(member, error)
        elif error is not None:
            early = self.members.all.get(self.members.ticket_of(farewell.badge) or "")
            if early is None or early.state is not State.CRASHED:
                raise error
            self._crash(early, error)

    def _may_restart(self, member: Member) -> bool:
        return member.crashes < self._terms.restarts.get(member.name, 0)

    def _crash(self, member: Member, error: AgentError | None) -> None:
        """Start a failed member again, or lose it. error: None if it left in order."""
        again = self._may_restart(member)
        if member.state is State.CRASHED:
            # the message is about the crash that is known
            if member.due or error is None:
                return
            if not again:
                self._give_up(member, error)
                return
            when = "as it started"
        else:
            if error is None or not again or not member.entries or self._terms.open:
                self._lose(member, error)
                return
            n = self.pacing.n
            when = f"at tick {member.n + 1 if member.owes(n) else n}"
            member.awaited = any(entry.lockstep for entry in member.entries)
            self._drop(member, error.cause, State.CRASHED)
        member.crashes += 1
        member.since = time.monotonic()
        member.due = member.since + backoff(member.crashes)
        member.until = member.due + self._terms.wait.back
        self._doubtful.add(member)
        how = uncoded(error.cause).removeprefix("was ")
        info(
            "crashed",
            f"{member.agent} crashed {when} ({how}); "
            f"started again, {member.crashes} of {self._terms.restarts[member.name]}",
            member.agent,
        )

    def _give_up(self, member: Member, error: AgentError) -> None:
        """Drop a member that did not come back, or end the run."""
        member.state = State.GONE
        if not self._terms.drop:
            self._finish(self.pacing.n)
            raise error
        info(
            "dropped", f"{uncoded(error)}; dropped at tick {self.pacing.n}", error.agent
        )

    def _lose(self, member: Member, error: AgentError | None) -> None:
        """Note that a member has left or failed, which may end the run."""
        going, local = bool(member.entries), member.name in self._terms.tickets
        left = f"{member.describe()} has left"
        if self._terms.open:
            info("left", str(error or left), member.agent)
            self.members.drop(member)
            return
        if not self.gathered and not local and going:
            info("left", str(error or f"{left}; it may come again"), member.agent)
            self.members.forget(member)
            return
        n = self.pacing.n
        held = member.owes(n)
        if going and error is None:
            cause = f"left after tick {member.n}, before the end of the run (R0522)"
            error = AgentError(member.agent, cause)
        if error is not None and not (self._terms.drop and going):
            self.members.drop(member, error.cause if going else "")
            if going:
                self._finish(member.n if held else n)
            raise error
        if error is not None:
            text = f"{uncoded(error)}; dropped at tick {member.n + 1 if held else n}"
            info("dropped", text, error.agent)
        self._drop(member, error.cause if error else "")

    def _drop(self, member: Member, cause: str, state: State = State.GONE) -> None:
        """Go on without a member, from this tick on."""
        held = member.owes(self.pacing.n)
        self.members.drop(member, cause, state)
        if held:
            # Members that wait for its values learn it at once, from the new roster.
            self.progress.update(self.pacing.n)
            self._say_roster()
        self.progress.pending.discard(member.name)

    def _finish(self, n: int) -> None:
        """End a failed run: let other members finish the ticks before the failure."""
        progress = self.progress
        progress.look()
        deadline = time.monotonic() + LAST
        while (done := progress.advance(n)) < n and time.monotonic() < deadline:
            with suppress(AgentError):  # the first failure is the one to report
                self.read()
            if progress.done > done:
                deadline = time.monotonic() + LAST

"""Guest: a lent host on the borrower's fabric, with an ear at home.

It has a session, a seat, a guard and ports of its own there. The agents are those of
the host at home, and one thread reads the mail of both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Protocol

from rems_net.agents.agent import Agent
from rems_net.agents.diagnosis import failure
from rems_net.agents.host.entrance import say_farewell
from rems_net.agents.host.guard import Guard
from rems_net.agents.host.host import Host
from rems_net.agents.host.inbox import LOOK, Inbox
from rems_net.agents.protocol.complaints import Complaints
from rems_net.agents.protocol.messages import Admission
from rems_net.agents.robot import Robot
from rems_net.agents.runtime import runtime
from rems_net.errors import FabricError
from rems_net.router.keys import STEP
from rems_net.router.mail import Letter, Question
from rems_net.router.session import Session

#: seconds a borrower's clock may be out of sight
PATIENCE = 5.0


class Home(Protocol):
    """The host at home, as its guest needs it."""

    name: str
    session: Session
    agents: dict[str, Agent]
    guard: Guard
    inbox: Inbox

    def attend(self, letter: Letter) -> None:
        """Take a letter from home. Raises what ends the loan."""

    def look(self) -> None:
        """See to the clock at home. Raises what ends the loan."""

    def asked(self, question: Question) -> None:
        """Somebody asks for the robot, here or there. Raises what ends the loan."""


class Guest(Host):
    """The agents of `home` on the fabric of `session`; nobody waits for them there."""

    def __init__(self, session: Session, home: Home, sources: Mapping[str, str]):
        super().__init__(session, home.name)
        self.home = home
        for agent in home.agents.values():
            self.engine.add(agent, sources)
        self._since = dict.fromkeys(self.agents, 1)
        self._stops = -1  # no number is known: STOP at home counts as well
        self.lease = Leases(home, self.guard)
        answer, complaints = self._answers.answer, self._complaints
        self.inbox: Inbox = Abroad(home, session, self.guard, answer, complaints)
        self.engine.given = self.inbox.given

    def enter(self) -> None:
        """Join. Raises FabricError with the reason of the borrower's clock."""
        key = self.session.key
        self._done = self.session.publisher(key("clock", STEP, "done"))
        self.declare()
        for name in self.agents:
            self.session.answer(key(name, "@lend"), self.inbox.box)
            self.session.present(key(name, "@alive"))
        self.join()
        for agent in self.agents.values():
            if isinstance(agent, Robot) and not agent.lockstep:
                runtime(agent).lease = self.lease

    def serve(self, question: Question) -> None:
        """Do what was called for; who asks for the robot may end the loan."""
        if question.key.endswith("/@lend"):
            self.home.asked(question)
        else:
            super().serve(question)

    def _obey(self, stops: int) -> None:
        self.engine.hold(self.lease.stopped)

    def blame(self, error: BaseException) -> tuple[str, str]:
        """The agent that failed here, and the cause."""
        return failure(self.acting, error)

    def leave(self, early: tuple[str, str] | None) -> None:
        """Take its leave of the borrower's clock. early: the agent, and why."""
        self.end()
        if not self.guard.lost:
            with suppress(FabricError):  # it has given this host up already
                say_farewell(self.session, self.badge, [], early)

    def end(self) -> None:
        """Ask the borrower's clock nothing more, and say what was dropped."""
        self.guard.end()
        self._complaints.total()
        for inlet in self.inlets:
            inlet.total()


class Leases:
    """A lent robot obeys while both clocks are heard; STOP of either stops it."""

    def __init__(self, home: Home, guard: Guard):
        self._home, self._guard = home, guard

    @property
    def stopped(self) -> bool:
        """Whether STOP holds, on one fabric or the other."""
        return self._home.guard.stopped or self._guard.stopped

    def age(self, n: int) -> float:
        """How old tick `n` is, or the newest at home where that is older."""
        newest = self._home.inbox.seat.newest
        return max(self._guard.age(n), self._home.guard.age(newest))


class Abroad(Inbox):
    """A guest's mail; what comes from home is for the host at home."""

    def __init__(
        self,
        home: Home,
        session: Session,
        guard: Guard,
        answer: Callable[[Question], None],
        complaints: Complaints,
    ):
        super().__init__(session, home.name, guard, answer, complaints)
        self.box, self.rates = home.inbox.box, home.inbox.rates
        self._home, self._prefix = home, home.session.key("")

    def take(self, letter: Letter | None) -> None:
        """Sort this letter. Raises Released or Orphaned, and what `home` raises."""
        if letter is not None and getattr(letter, "key", "").startswith(self._prefix):
            self._home.attend(letter)
        else:
            super().take(letter)

    def begin(self, admission: Admission) -> None:
        """Take a seat, for as long as the borrower's clock is in sight."""
        patience = min(admission.patience, PATIENCE)
        super().begin(admission._replace(patience=patience))

    def _wait(self, timeout: float | None) -> bool:
        self._home.look()
        return super()._wait(LOOK if timeout is None else timeout)

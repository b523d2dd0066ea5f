"""Lender: a host of an open fabric, which can be lent to another fabric.

A robot belongs to one fabric at a time. While it is lent it steps with the borrower's
clock and obeys who is there; its entry stays at home, where STOP stops it, too. It
comes back by itself: when the borrower's run ends or its clock is gone, when it is
asked for, and when its own clock is gone.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from threading import Event

from rems_net.agents.host.host import Host
from rems_net.agents.host.lending.guest import Guest
from rems_net.agents.host.seat import Orphaned, Released
from rems_net.agents.protocol.messages import Beat, Lent, Loan, pack_done, read_loan
from rems_net.agents.robot import Robot
from rems_net.agents.runtime import runtime
from rems_net.errors import FabricError, RemsError, WireError, nearest
from rems_net.events import warn
from rems_net.router.find import fabrics
from rems_net.router.gate.standing import check_member
from rems_net.router.mail import Letter, Question
from rems_net.router.message import pack, read
from rems_net.router.session import Session

#: how often the clock at home is told where the robot is, and seconds for its answer
TRIES, PATIENCE = 5, 0.5


class Returned(Exception):  # noqa: N818 - not an error: somebody asks for the robot
    """It is to come back. question: whom to tell when it has."""

    def __init__(self, question: Question):
        super().__init__("it was asked for")
        self.question = question


class HomeGone(Exception):  # noqa: N818 - not an error of this host
    """The clock at home let it go, or is gone itself."""

    def __init__(self, cause: Released | Orphaned):
        super().__init__(str(cause))
        self.cause = cause


class Lender(Host):
    """Runs agents on an open fabric; one robot alone can be lent."""

    #: the fabric that it is lent to, and what the clock at home knows of it
    lent = known = ""

    def declare(self) -> None:
        """Be asked for the robot, too."""
        super().declare()
        agent, *more = self.agents.values()
        if isinstance(agent, Robot) and not more:
            self.session.answer(self.session.key(agent.key, "@lend"), self.inbox.box)

    def join(self) -> None:
        """Ask the clock to be let in; it knows of no loan then."""
        super().join()
        self.known = ""

    def step(self, beat: Beat) -> None:
        """Do a tick, unless a loan has begun and ended since it came."""
        if self.known != self.lent:
            self._tell_clock()
        if beat.tick.n == self.inbox.seat.current:
            super().step(beat)

    def serve(self, question: Question) -> None:
        """Do what was called for. A loan lasts until this returns."""
        if not question.key.endswith("/@lend"):
            super().serve(question)
            return
        with ExitStack() as stack:
            with question:
                try:
                    guest = self._send(read_loan(question.payload), stack)
                except RemsError as error:
                    question.refuse(str(error))
                    return
                self._answer(question, guest.session.fabric)
            over = self._live(guest)
            if isinstance(over, Returned):
                with over.question as asked:  # it may have come by the guest's session
                    self._answer(asked, guest.session.fabric, back=True)
        warn("lent", f"{self.name} is back on {self.session.fabric!r}: {over}")

    def _answer(self, question: Question, there: str, *, back: bool = False) -> None:
        """Say on which fabric the robot is: `there`, or back; at no key but its own."""
        here = self.session.fabric
        for fabric in (here, there):
            if question.covers(key := f"{fabric}/{self.name}/@lend"):
                question.answer(key, pack(here if back else there))

    # -- going -------------------------------------------------------------------

    def _send(self, loan: Loan, stack: ExitStack) -> Guest:
        """Join the borrower's run, the robot standing still meanwhile.

        Raises FabricError where that can't be; it stays where it is then.
        """
        to, here = loan.fabric, self.session.fabric
        if to in ("", here):
            raise FabricError(f"it is on {here!r}, and not lent")
        stack.callback(self._clear, f"{to}/")  # when that session is closed
        session = stack.enter_context(Session(replace(self.session.link, fabric=to)))
        self._check(session)
        self.engine.hold(True)
        guest = Guest(session, self, loan.sources)
        try:
            guest.enter()
        except RemsError as error:
            guest.end()
            self.engine.hold(self.guard.stopped)
            raise FabricError(
                f"{to!r} does not take it: {error} A run takes it that was started "
                f"with `--elsewhere {self.name}`."
            ) from None
        self.lent = to
        self.start_anew()  # what it was told here does not count there
        self._tell_clock()
        warn("lent", f"{self.name} is lent to {to!r}")
        return guest

    def _check(self, session: Session) -> None:
        """Raise FabricError for a fabric that can't have it."""
        check_member(session)
        to, key = session.fabric, session.key
        if not session.who(key("clock", "@alive")):
            there = [name for name in fabrics(session) if name != to]
            raise FabricError(
                f"there is no fabric {to!r} at {session.link.endpoint}; there is "
                f"{', '.join(there)}.{nearest(to, there)}"
            )
        if session.who(key(self.name, "@alive")):
            raise FabricError(
                f"there is a {self.name} on {to!r} already; start one of the two with "
                "another name"
            )
        ticks = session.ask(key("clock", "tick"), first=True)
        if not ticks:
            raise FabricError(f"the clock of {to!r} does not answer yet; try again")
        for mail in ticks:
            tick = read(mail.payload)
            if type(tick) is dict and not tick.get("pace"):
                raise FabricError(
                    f"the run on {to!r} is as fast as it can be, and a lent robot "
                    "lives in real time; give that run a pace: --pace 1"
                )

    # -- away --------------------------------------------------------------------

    def _live(self, guest: Guest) -> Exception:
        """Be with the borrower, and come back; why.

        Raises what ends this host, or its membership at home.
        """
        early: tuple[str, str] | None = None
        try:
            guest.step_on()
        except Returned as over:
            early = self.name, f"was returned to {self.session.fabric!r}"
            return over
        except Released:
            return Released("the run that it was lent to is over")
        except Orphaned as gone:
            if guest.inbox.alone:
                self.inbox.alone = True
                raise
            return gone
        except HomeGone as gone:
            early = self.name, f"its own fabric, {self.session.fabric!r}, is gone"
            raise gone.cause from None
        except (Exception, SystemExit) as error:
            early = guest.blame(error)
            raise
        finally:
            self.engine.hold(True)
            guest.leave(early)
            self._come_back()

    def _come_back(self) -> None:
        """Go on at home; what was said there and here meanwhile does not count."""
        self.lent = ""
        self.inbox.latest.clear()
        self.inbox.given.clear()
        self.start_anew()
        for agent in self.agents.values():
            if isinstance(agent, Robot) and not agent.lockstep:
                runtime(agent).lease = self.lease
        self._tell_clock()
        self.engine.hold(self.guard.stopped)

    def _tell_clock(self) -> None:
        """Tell the clock at home where the robot is; again, where it was not heard."""
        lent = Lent(self.badge, self.lent).to_wire()
        for _ in range(TRIES):
            try:
                if self.session.ask(
                    self.session.key("clock", "@lent"), lent, PATIENCE, first=True
                ):
                    self.known = self.lent
                    return
            except FabricError:
                return  # no member any more: it will join anew
            Event().wait(0.05)

    def _clear(self, there: str) -> None:
        """Take what came by now; what came from there is for nobody any more."""
        box = self.inbox.box
        while not box.empty():
            letter = box.get(0.0)
            if not getattr(letter, "key", "").startswith(there):
                self.inbox.take(letter)
            elif isinstance(letter, Question):
                with letter:
                    letter.refuse(f"it is back on {self.session.fabric!r}")

    # -- at home, meanwhile ------------------------------------------------------

    def attend(self, letter: Letter) -> None:
        """Take a letter from home. Raises Returned or HomeGone."""
        if isinstance(letter, Question):
            if letter.key.endswith("/@lend"):
                self.asked(letter)
                return
            if not letter.key.endswith("/@schema"):
                with letter:
                    letter.refuse(f"it is lent to {self.lent!r}: --fabric {self.lent}")
                return
        seat = self.inbox.seat
        try:
            self.inbox.take(letter)
        except (Released, Orphaned) as gone:
            raise HomeGone(gone) from None
        while seat.beats:
            beat = seat.take()
            if seat.has_roster(beat.tick.epoch):
                seat.take_roster(beat.tick.epoch)  # those before are not needed
            if self.known != self.lent:
                self._tell_clock()
            self.guard.take(beat.stops)
            if self.guard.stopped:
                self.engine.hold(True)
            self._done.put(pack_done(self.badge, beat.tick.n))

    def look(self) -> None:
        """See to the clock at home. Raises HomeGone."""
        try:
            self.inbox.search()
        except Orphaned as gone:
            raise HomeGone(gone) from None

    def asked(self, question: Question) -> None:
        """Somebody asks for the robot, here or there. Raises Returned."""
        try:
            loan = read_loan(question.payload)
        except WireError as error:
            with question:
                question.refuse(str(error))
            return
        if loan.fabric in ("", self.session.fabric):
            raise Returned(question)
        with question:
            question.refuse(
                f"it is lent to {self.lent!r} already. Type: rems return {self.name}"
            )

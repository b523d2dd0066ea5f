"""STOP store: a router stores STOP, so that it outlives the run that put it."""

import socket
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from threading import Condition, Thread
from typing import NamedTuple

from rems_net.errors import FabricError, WireError
from rems_net.router.gate.access import WHO, is_of_team
from rems_net.router.gate.identity import answer_for
from rems_net.router.gate.stops import MOST, Stop
from rems_net.router.gate.users import Users
from rems_net.router.keys import FABRIC, is_name
from rems_net.router.mail import Mail, Mailbox, Presence, Question
from rems_net.router.message import pack, read
from rems_net.router.relay.gate import Gate
from rems_net.router.relay.notices import Notices
from rems_net.router.relay.people import People
from rems_net.router.session import Session
from rems_net.router.settings import Link

#: fabrics of one team, or of none, whose STOP is stored; more are ignored
FABRICS = 1_000
#: s. A release waits this long for a STOP put just before: another thread handles it
#: and may be behind.
BEHIND = 0.1

#: s. STOP is put again to a clock that does not hold it yet after this time.
AGAIN = 0.25
END = Presence("", False)

#: ports that are tried for Zenoh, behind the gate
TRIES = 5
#: s. A frozen laptop counts as gone after this time.
LEASE = 3.0


def _show(line: str) -> None:
    print(line, flush=True)


@contextmanager
def class_router(
    listen: str,
    users: Users | None = None,
    fabric: str = FABRIC,
    report: Callable[[str], None] = _show,
) -> Iterator[Session]:
    """Run a router that stores STOP, and yield a session on it.

    users: those that are let in; None for everybody.
    report: prints a line about refusals. Raises FabricError if it can't listen, and at
        the end if the gate has failed.
    """
    link = Link(listen, serve=True, fabric=fabric, lease=LEASE, users=users)
    with Gate(listen, users, report, fabric) as gate, _behind(link) as session:
        teams = users.teams if users is not None else ()
        store = StopStore(session, teams, gate.people, gate.notices)
        store.keep()
        if users is not None:
            answer = answer_for(users, fabric, gate.people.seen_by)
            session.answer_at_once(f"{WHO}/*", answer)
        gate.open(session.link.behind, session.id)
        try:
            yield session
        finally:
            store.end()


def _behind(link: Link) -> Session:
    """Open a router at a free port of this machine."""
    for left in reversed(range(TRIES)):
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        session = Session(replace(link, behind=f"tcp/127.0.0.1:{port}"))
        try:
            session.open()
            break
        except FabricError:  # another program was faster
            if not left:
                raise
    return session


class Held(NamedTuple):
    """A STOP: its author, the time of day, and the monotonic time [s]."""

    by: str
    at: str
    since: float


class StopStore:
    """Store of the STOP of every fabric on a router.

    Any program latches it by putting `true` at `<fabric>/stop`. A run's clock
    (`<fabric>/clock/stops`) releases it or, without a clock, a question for
    `<fabric>/stop/@release`. A clock that starts asks for `<fabric>/stop/@holds`;
    people learn from `<fabric>/stop/@why` whose STOP it is. `<fabric>/stop/@lost` is
    answered for each fabric whose robots were lost.
    """

    def __init__(
        self,
        session: Session,
        teams: Iterable[str],
        people: People,
        notices: Notices,
    ):
        self._session, self._teams = session, tuple(teams)
        self._people, self._notices = people, notices
        #: by team ("" for none), then by fabric
        self._stopped: defaultdict[str, dict[str, Held]] = defaultdict(dict)
        self._heard = Condition()
        #: fabrics whose clock has come, or come back, and does not hold STOP yet
        self._untold: set[str] = set()
        self._clocks = Mailbox()

    def keep(self) -> None:
        """Subscribe and answer from now on, in Zenoh's own thread."""
        session = self._session
        session.watch_at_once("*/stop", self._hear, origin="others")
        session.watch_at_once("*/stop", self._hear_own, origin="own")
        session.watch_at_once("*/clock/stops", self._hear_clock)
        session.watch_presence("*/clock/@alive", self._clocks)
        Thread(target=self._remind, name="stop", daemon=True).start()
        session.answer_at_once("*/stop/@holds", self._tell)
        session.answer_at_once("*/stop/@lost", self._tell_lost)
        session.answer_at_once("*/stop/@why", self._tell_why, apart=True)
        session.answer_at_once("*/stop/@release", self._release, apart=True)

    def end(self) -> None:
        """Remind no clock any more."""
        self._clocks.put(END)

    def _remind(self) -> None:
        """Put STOP again to a clock that has come, or come back, until it holds it."""
        while (letter := self._clocks.get(AGAIN if self._untold else None)) != END:
            with self._heard:
                if isinstance(letter, Presence) and letter.alive:
                    self._untold.add(letter.key.partition("/")[0])
                self._untold &= {f for held in self._stopped.values() for f in held}
                untold = [*self._untold]
            for fabric in untold:
                self._session.put(f"{fabric}/stop", pack(True))

    def _hear(self, mail: Mail) -> None:
        """Store a STOP of a client; the gate knows which user put it."""
        by = self._people.who_stopped(mail.key.partition("/")[0])
        if held := self._hold(mail, by):
            fabric = mail.key.partition("/")[0]
            if fabric == self._session.fabric:
                stop, *words = Stop(by, held.at, 0.0).on(fabric).split(" ")
                self._notices.add(stop, " ".join(words), soon=True)
            else:  # a team can put and release STOP as often as it likes
                self._notices.add(by, "said STOP on {last}: {times}", repr(fabric))

    def _hear_own(self, mail: Mail) -> None:
        """Store a STOP that was typed where the router runs."""
        self._hold(mail, "the teacher, where the router runs")

    def _hold(self, mail: Mail, by: str) -> Held | None:
        """Return the stored STOP; None if it is not a STOP, or not a new one."""
        fabric = mail.key.partition("/")[0]
        if mail.size != 1 or mail.payload != pack(True) or not is_name(fabric):
            return None
        with self._heard:
            held = self._beside(fabric)
            if fabric in held or len(held) >= FABRICS:
                return None
            held[fabric] = Held(by, time.strftime("%H:%M:%S"), time.monotonic())
            self._heard.notify_all()
            return held[fabric]

    def _beside(self, fabric: str) -> dict[str, Held]:
        """Return the STOPs of the same team: each team can fill only its own space."""
        teams = (team for team in self._teams if is_of_team(team, fabric))
        return self._stopped[next(teams, "")]

    def _hear_clock(self, mail: Mail) -> None:
        try:
            _, stops = read(mail.payload)
        except (WireError, TypeError, ValueError):
            return
        fabric = mail.key.partition("/")[0]
        if type(stops) is int:
            with self._heard:
                self._untold.discard(fabric)
                if stops % 2 == 0:
                    self._beside(fabric).pop(fabric, None)

    def _tell(self, question: Question) -> None:
        for fabric in sorted(set().union(*self._stopped.values())):
            if question.covers(f"{fabric}/stop/@holds"):
                question.answer(f"{fabric}/stop/@holds", pack(True))

    def _tell_lost(self, question: Question) -> None:
        for fabric in self._people.lost(time.monotonic()):
            if question.covers(f"{fabric}/stop/@lost"):
                question.answer(f"{fabric}/stop/@lost", pack(True))

    def _tell_why(self, question: Question) -> None:
        """Answer with the author of STOP; with `?new`, wait for one that is behind."""
        fabric = question.key.partition("/")[0]
        with self._heard:
            stopped = self._beside(fabric)
            if "new" in question.parameters:
                self._heard.wait_for(lambda: fabric in stopped, BEHIND)
            held = stopped.get(fabric)
        if held is not None:
            now = time.monotonic()
            lost = self._people.lost(now).get(fabric, [])[:MOST]
            said = Stop(held.by, held.at, now - held.since, lost)
            question.answer(question.key, said.to_wire())

    def _release(self, question: Question) -> None:
        fabric = question.key.partition("/")[0]
        with self._heard:
            stopped = self._beside(fabric)
            held = self._heard.wait_for(lambda: fabric in stopped, BEHIND)
            stopped.pop(fabric, None)
        question.answer(question.key, pack({"released": held}))

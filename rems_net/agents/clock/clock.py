"""Clock: the only source of time on a fabric, and the keeper of its roster."""

import time
from collections.abc import Callable
from typing import Any

from rems_net.agents.clock.admission import LOOK, Admissions
from rems_net.agents.clock.broadcaster import Broadcaster
from rems_net.agents.clock.dispatcher import Dispatcher
from rems_net.agents.clock.members import Members
from rems_net.agents.clock.opening import Away, become_clock, stop_holds
from rems_net.agents.clock.pacing import Pacing
from rems_net.agents.clock.progress import Progress
from rems_net.agents.clock.replies import Replies
from rems_net.agents.protocol.badge import new_run
from rems_net.agents.protocol.complaints import Complaints
from rems_net.agents.protocol.limits import AHEAD, JOIN_TIME_EACH
from rems_net.agents.protocol.terms import Terms
from rems_net.agents.tick import Tick
from rems_net.errors import AgentError
from rems_net.events import info
from rems_net.router.gate.stops import who_stopped
from rems_net.router.mail import Mailbox
from rems_net.router.session import Session

#: s. The rest of a wait is slept: a sleep ends nearer to its time than a wait for mail.
NAP = 0.002
#: s. A tick that takes longer is sent again: it, or an answer, may be lost.
RESEND_INTERVAL = 0.25
#: s. Time between two reports of a held tick.
HELD = 1.0
#: s. A run that was ended waits this long for its newest tick.
ENDING = 2.0


class Clock:
    """Makes the ticks of a run, and publishes its members.

    look: called now and then while waiting; raises AgentError to end the run.
    lives: returns whether the process of this host is known to live, seen or not.
    start: starts the process of a crashed host again, if it is on this machine.
    """

    def __init__(
        self,
        session: Session,
        terms: Terms,
        *,
        look: Callable[[], None] = lambda: None,
        lives: Callable[[str], bool] = lambda host: False,
        start: Callable[[str], None] = lambda host: None,
    ):
        self.session, self.terms = session, terms
        self.run_id = new_run()
        #: makes the ticks; the clock's verbs are its verbs
        self.pacing = Pacing(terms.dt, terms.pace, waits_for_nobody=terms.open)
        self.members = members = Members(self.run_id, terms)
        self._progress = progress = Progress(members)
        self.broadcaster = Broadcaster(session, self.run_id)
        self._admissions = admissions = Admissions(
            session,
            self.pacing,
            members,
            progress,
            look=look,
            lives=lives,
            start=start,
            read=lambda timeout: self._dispatcher.read(timeout),
            say_roster=self._say_roster,
        )
        self._box, self._complaints = Mailbox(), Complaints(info)
        self._replies = Replies(
            admissions, self.broadcaster, self._box, self._complaints
        )
        self._dispatcher = Dispatcher(self._replies)
        #: ticks that were made since letters were read
        self._unread = 0

    @property
    def dt(self) -> float:
        """Seconds of a tick."""
        return self.terms.dt

    @property
    def tick(self) -> Tick:
        """The newest tick."""
        return self.pacing.tick

    @property
    def started(self) -> float:
        """Monotonic time [s] at which all expected hosts had joined; 0.0 before."""
        return self._replies.started

    @property
    def done(self) -> int:
        """The newest tick that all members have done."""
        return self._progress.done

    def open(self) -> None:
        """Become this fabric's clock. Raises FabricError if it has one already."""
        session = self.session
        replies = self._replies
        become_clock(session, self.run_id, self._dispatcher.watch, replies.tell_age)
        replies.declare()
        self.broadcaster.open()
        if stop_holds(session):
            self.broadcaster.hold(True)
            said = who_stopped(session)
            info(
                "stop",
                said.on(session.fabric)
                if said is not None
                else "STOP holds on this router: every robot must stand until "
                "`rems stop --release`",
            )

    def gather(self) -> None:
        """Wait until every expected host has joined.

        Raises AgentError for one that fails or does not come.
        """
        agents = sum(len(agents) for agents in self.terms.hosts.values())
        patience = self.terms.wait.start + agents * JOIN_TIME_EACH
        deadline, away = time.monotonic() + patience, Away(self.terms)
        while missing := self.terms.hosts.keys() - self.members.all.keys():
            if sentence := away.news(missing):
                info("waiting", sentence)
            joined = len(self.members.all)
            self._read()
            if len(self.members.all) > joined:
                deadline = time.monotonic() + patience
            if time.monotonic() > deadline or self.pacing.ended:
                raise away.never_came(missing, patience, ended=self.pacing.ended)
        self._admissions.gathered = True
        self._replies.started = time.monotonic()

    def run(self, ticks: int) -> None:
        """Make this many ticks, and wait until every member has done the last.

        At a pace, tick n is due at start + n dt / pace (absolute, so it never drifts)
        and when every member has done tick n - 1, or an older one if ticks are late:
        `Pacing.ahead`. At full speed, it is due when every member has done tick
        n - AHEAD; but one by one if a member may die and the run go on (dropped, or
        started again): a killed process takes its unsent values with it, so we would
        not know at which tick it was. Raises AgentError when a member fails or dies and
        is not to be dropped.
        """
        pacing = self.pacing
        pacing.naming = self._progress.describe
        pacing.set(pacing.factor)
        careful = self.terms.drop or any(self.terms.restarts.values())
        for _ in range(ticks):
            n = self.tick.n + 1
            if pacing.factor:  # tick n - 1 is done meanwhile: one wait, not two
                self._await_turn()
            self._await_done(n - (1 if careful else pacing.ahead()))
            self._await_turn()
            while self._admissions.awaited() and not pacing.ended:
                self._read()
            self._unread += 1
            if self._unread > AHEAD:  # no tick was waited for, and none may ever be
                self._read(0.0)
            if pacing.ended:
                break
            if self._progress.update(n):
                self._say_roster()
                self._progress.look()
            tick = pacing.make(self._progress.roster.epoch)
            self._replies.note(n)
            self.broadcaster.publish_tick(tick)
        self._await_done(self.tick.n)

    def _read(self, timeout: float = LOOK) -> None:
        self._unread = 0
        self._admissions.read(timeout)

    def _say_roster(self) -> None:
        self._dispatcher.watch_closings()
        self.broadcaster.publish_roster(self._progress.roster)

    def _await_turn(self) -> None:
        """Wait while paused, then until the next tick is due."""
        while self.pacing.held or self.pacing.left() > 0:
            if self.pacing.held:
                self._await_done(self.tick.n)
                self._read()
            elif (left := self.pacing.left()) > NAP:
                self._read(min(left - NAP / 2, LOOK))
            elif left > 0:
                time.sleep(left)

    def _await_done(self, n: int) -> None:
        """Wait until every member has done tick n, and so all before."""
        begun = said = told = ended = now = time.monotonic()
        progress = self._progress
        while progress.advance(n) < n:
            holding = frozenset(progress.pending) if self.pacing.factor else None
            self._read()
            before, now = now, time.monotonic()
            if holding is not None:
                self.pacing.blame(holding, now - before)
            if now - said > RESEND_INTERVAL:
                said = now
                self._ask_late()
            if now - told > HELD and progress.advance(n) < n:
                told = now
                who = progress.describe(progress.pending)
                held = f"tick {self.done + 1} is held by {who}"
                info("held", f"{held} for {now - begun:.1f} s")
            if not self.pacing.ended:
                ended = now
            elif now - ended > ENDING and progress.advance(n) < n:
                late = progress.holders(progress.pending)[0].agent
                why = (
                    f"had not done tick {self.done + 1} when the run was ended (R0522)"
                )
                raise AgentError(late, why)

    def _ask_late(self) -> None:
        """Send unfinished ticks again, and ask late members at which line they are.

        A member that has done the tick repeats its `done`; one that never received it
        begins; one that waits for a value asks for it. So a lost message costs only
        time.
        """
        self.broadcaster.repeat(self.done)
        for host in self._progress.pending & self.members.all.keys():
            for entry in self.members.all[host].entries[:1]:
                where = self.session.key(entry.key, "@where")
                self.session.ask_at_once(where, self._box.put)

    def release(self, seconds: float) -> AgentError | None:
        """End every membership and wait for the farewells.

        Returns the first failure of a member while it closed.
        """
        self.members.release()
        self._progress.update(self.tick.n + 1)
        self._say_roster()
        failure: AgentError | None = None
        said = time.monotonic()
        deadline = said + seconds
        while self.members.present() and (now := time.monotonic()) < deadline:
            if now - said > RESEND_INTERVAL:
                said = now
                self._say_roster()
            try:
                self._read()
            except AgentError as error:
                failure = failure or error
        self._complaints.total()
        return failure

    def made(self) -> list[str]:
        """Return the files that outputs on this machine made; known after `release`."""
        here = [m for name, m in self.members.all.items() if name in self.terms.tickets]
        return [path for m in here for path in m.made]

    def status(self) -> list[dict[str, Any]]:
        """Return, for each agent: agent, kind, host, rate [Hz], seen [s ago], tick."""
        return self.members.status()

"""Inbox: received ticks, rosters, values and questions. One thread reads it."""

from collections import deque
from collections.abc import Callable
from math import inf
from threading import main_thread

from rems_net.agents.about.wiring import Entry
from rems_net.agents.host.guard import Guard
from rems_net.agents.host.leases import Leases
from rems_net.agents.host.membership import Membership, Orphaned, Value
from rems_net.agents.host.outlet import CROWD, Done, glob
from rems_net.agents.protocol.badge import run_of
from rems_net.agents.protocol.complaints import Complaints
from rems_net.agents.protocol.messages import Admission, Beat, read_age, read_beat
from rems_net.agents.protocol.roster import Roster
from rems_net.agents.wall import wall
from rems_net.errors import WireError
from rems_net.events import info, warn
from rems_net.router.gate.stops import read_said
from rems_net.router.keys import STEP, crowd_key
from rems_net.router.mail import Letter, Mail, Mailbox, Presence, Question
from rems_net.router.message import Stamp
from rems_net.router.publisher import Watch
from rems_net.router.session import Session

#: s. If a value is later than this, the host asks for it by its key.
RETRY_INTERVAL = 0.25
#: s. A run waits this long, once, for the first value of a free-running agent.
FIRST = 0.25
#: s. Time between two searches for a clock that is out of sight.
LOOK = 0.5
#: s. If the clock is out of sight for longer, the host warns.
TOLD = 1.0
#: Number of calls that may wait for the end of a tick; more are refused.
CALLS = 1_000


class Inbox:
    """A host's mail, sorted.

    answer: called with a Question about values, at once.  leases: the programs that may
    command the robots here.  done: settled before this host waits, so that the clock
    knows all ticks that are done.
    """

    def __init__(
        self,
        session: Session,
        name: str,
        guard: Guard,
        answer: Callable[[Question], None],
        complaints: Complaints,
        leases: Leases,
        done: Done,
    ):
        self.session, self.name, self.guard, self.done = session, name, guard, done
        self.box = Mailbox()
        #: the thread in which the host steps its agents
        self.thread = main_thread()
        #: the `every` of each agent, if all agents here are free-running
        self.rates: list[int] = []
        #: full keys at which programs outside may put values for this host
        self.told: set[str] = set()
        #: globs that a crowd watches for outside values; they match other hosts' too
        self.overheard: set[str] = set()
        #: by full key, the newest value of an agent, with its stamp
        self.latest: dict[str, tuple[Mail, Stamp]] = {}
        self.given, self.leases = leases.given, leases
        #: calls of verbs, which wait for the end of the tick
        self.calls: deque[Question] = deque()
        self._answer, self._complaints = answer, complaints
        #: called with a message on a call from outside, if an output here records it
        self.hear_call: Callable[[Mail], None] = lambda mail: None
        #: whether another program than the run has started this host. If so, it warns
        #: when the clock is out of sight, and leaves for the clock of another run
        self.distant = False
        #: wall time at which the clock was lost, once a warning was given; else 0
        self._missed = 0.0
        self._patience = 0.0
        #: wall time of the last search for a clock that is out of sight
        self._searched = 0.0
        #: the watch on the clock's liveliness token, and whether the token was seen
        self._sight: Watch | None = None
        self._sighted = False
        #: whether the parent of this host is gone
        self.alone = False
        #: the newest tick at the last call of `idle`, and when it was first seen
        self._asked_at: tuple[int, float] = -1, 0.0
        self._tick_key = session.key("clock", "tick")
        self._roster_key = session.key("clock", "roster")
        self._step_tick_key = session.key("clock", STEP, "tick")
        self._step_roster_key = session.key("clock", STEP, "roster")
        self._age_key = session.key("clock", "@age")
        self._stop_key = session.key("stop", "@why")

    def hear(self, keys: set[str], told: set[str], *, crowd: bool) -> None:
        """Subscribe to these keys. told: keys at which programs outside may put.

        A crowd subscribes once per kind for programs outside.
        """
        self.told = told
        if crowd:
            self.overheard = {glob(key) for key in told}
            keys = keys - told | self.overheard
        # A host in the program of its run shares the session with that program, which
        # may put values, too.
        shared = told | self.overheard if self.session.near else ()
        for key in sorted(keys):
            self.session.watch(key, self.box, remote=key not in shared)

    def watch(self) -> None:
        """Subscribe to the clock; if free-running, messages may be lost."""
        tick = self._tick_key if self.rates else self._step_tick_key
        for key in (tick, self._step_roster_key):
            self.session.watch(key, self.box)

    def begin(self, admission: Admission) -> None:
        """Begin a membership of the run that has admitted this host."""
        self.membership = Membership(
            self.session.fabric,
            self.name,
            admission,
            self.rates,
            self.told,
            self.latest,
            self.given,
            self.leases.check,
        )
        self._patience, self._missed = admission.patience, 0.0
        membership = self.membership
        self.guard.begin(admission.badge, admission.stops, lambda: membership.newest)
        clock = self.session.key("clock", "@run", str(membership.run))
        if self._sight is not None:
            self._sight.close()
        self._sighted = False
        self._sight = self.session.watch_presence(clock, self.box)

    def read(self, timeout: float | None) -> bool:
        """Sort one letter; return False if none came in time.

        Raises Released or Orphaned, from the letter.
        """
        letter = self.box.get(timeout)
        self.take(letter)
        return letter is not None

    def take(self, letter: Letter | None) -> None:
        """Sort this letter. Raises Released or Orphaned, from the letter."""
        if isinstance(letter, Mail):
            try:
                self._sort(letter)
            except WireError as error:
                # Any program can put anything at a key; that ends no run.
                self._complaints.about(letter.key, error)
        elif isinstance(letter, Question):
            if "/@call/" not in letter.key:
                self._answer(letter)
            elif len(self.calls) < CALLS:
                self.calls.append(letter)
            else:
                with letter:
                    letter.refuse("too many calls wait here; call again later")
        elif isinstance(letter, Presence):
            self._sighted = True
            self.guard.see(letter.alive)
        elif isinstance(letter, Orphaned):
            self.alone = True
            raise letter

    def _sort(self, mail: Mail) -> None:
        key, membership = mail.key, self.membership
        if key == self._step_tick_key or key == self._tick_key:
            beat = read_beat(mail.payload)
            membership.hear_beat(beat)
            if beat.run == membership.run:
                self.guard.see(True)
        elif key in (self._step_roster_key, self._roster_key):
            membership.hear_roster(Roster.from_wire(mail.payload))
        elif key == self._age_key:
            self._hear_of_clock(read_age(mail.payload).run)
        elif key == self._stop_key:
            info("stop", read_said(mail.payload).on(self.session.fabric))
        elif key.endswith("/@event/called"):
            self.hear_call(mail)
        elif (
            not self.overheard
            or key in self.told
            or glob(key) not in self.overheard
            # This host may read what robots of another host obey.
            or run_of(mail.stamp().badge) == membership.run
        ):
            membership.hear_value(mail)

    def look(self) -> None:
        """Answer questions for a moment without a clock. Raises Orphaned."""
        until = wall() + LOOK
        while (left := until - wall()) > 0:
            letter = self.box.get(left)
            if not isinstance(letter, Mail | Presence):
                self.take(letter)

    def next_beat(self) -> Beat | None:
        """Return the next tick; None if there is a call or a lost message to handle."""
        membership = self.membership
        while not membership.beats:
            if self.calls or membership.repeated:
                return None
            self._wait(None)
        if self.rates:
            while not self.box.empty():
                self.read(0)
        return membership.take()

    @property
    def idle(self) -> float:
        """Seconds for which there has been no other tick, since the first look at it.

        Read in Zenoh's thread; a host that steps pays nothing for it.
        """
        if self._sight is None:  # this host is not admitted yet
            return inf
        now, n = wall(), self.membership.current
        if self._asked_at[0] != n or self.membership.beats:
            self._asked_at = n, now
        return now - self._asked_at[1]

    def roster_of(self, epoch: int) -> Roster:
        """Return the roster that a tick names; ask for it if it was lost."""
        since = 0.0
        while not self.membership.has_roster(epoch):
            since = since or wall()
            if self._in_vain(since):
                asked = f"{self._roster_key}?epoch={epoch}"
                self.session.ask_at_once(asked, self.box.put)
                since = 0.0
        return self.membership.take_roster(epoch)

    def value(self, key: str, n: int, writer: Entry) -> Value | None:
        """Return the value of the full key at tick n; None once its writer has left.

        If a value does not come, the host asks for it by its key: a lost message costs
        time, never a byte of the recording.
        """
        since = asked = 0.0
        while True:
            value = self.membership.value(key, n)
            if value is not None:
                return value
            if not self.membership.writes_on(writer, n):
                return None
            since = since or wall()
            # Not at each of up to AHEAD ticks that the clock repeats: all hosts answer,
            # and several crowds would do nothing else.
            if self._in_vain(since) and wall() - asked > RETRY_INTERVAL:
                asked = wall()
                self.session.ask_at_once(f"{key}?since={n}", self.box.put)
                if self.membership.sizes[writer.badge] > CROWD:
                    together = f"{crowd_key(key)[0]}?since={n}"
                    self.session.ask_at_once(together, self.box.put)
                since = 0.0
            # A crowd's values come together. Other letters wait: one of them may end
            # the run, and this tick is still to be done.
            for mail in self.box.run_of(self.membership.steps):
                try:
                    self.membership.hear_value(mail)
                except WireError as error:
                    self._complaints.about(mail.key, error)

    def ask_first(self, key: str) -> None:
        """Ask a free-running agent for its value at this full key, if none has come.

        Its first tick may come later than ours. Its answer may take FIRST s.
        """
        since = wall()
        if key not in self.latest:
            self.session.ask_at_once(key, self.box.put)
        while key not in self.latest and (left := since + FIRST - wall()) > 0:
            self._wait(left)

    def _in_vain(self, since: float) -> bool:
        """Wait for a letter; return True if it is time to ask for the missing message.

        since: when waiting began. Other letters come all the time on an open fabric.
        """
        came = self._wait(RETRY_INTERVAL)
        if came and not self.membership.repeated and wall() - since < RETRY_INTERVAL:
            return False
        self.membership.repeated = False
        return True

    def _wait(self, timeout: float | None) -> bool:
        """Sort one letter, and check on the clock while it is out of sight."""
        if self.done.owed and self.box.empty():
            self.done.settle()
        lost = self.guard.lost
        if timeout is None and (lost or not self._sighted):
            timeout = LOOK
        if self.distant and (lost > TOLD or self._missed):
            self._warn_of_sight(lost)
        came = self.read(timeout)
        if not (came or lost or self._sighted):
            # If the clock dies while it admits us, we never see its liveliness token,
            # and so never see it disappear. Treat it as lost.
            self.guard.see(False)
        if lost:
            self.search()
        return came

    def search(self) -> None:
        """Search for the clock if it is out of sight. Raises Orphaned."""
        lost = self.guard.lost
        # Another clock's ticks may come meanwhile.
        if lost and wall() - self._searched > LOOK:
            self._searched = wall()
            if lost > self._patience:
                raise Orphaned(f"the clock is out of sight for {lost:.0f} s")
            # Other programs can remove a token; an answer is the clock's own.
            self.session.ask_at_once(self._age_key, self.box.put)

    def _warn_of_sight(self, lost: float) -> None:
        if lost and not self._missed:
            self._missed = wall() - lost
            warn("clock", "the clock is out of sight; waiting for it")
        elif not lost:
            warn("clock", f"the clock is back, after {wall() - self._missed:.0f} s")
            self._missed = 0.0

    def _hear_of_clock(self, run: int) -> None:
        if run == self.membership.run:
            self.guard.see(True)
        elif self.distant and self.guard.lost > LOOK:
            # A host that its own run has started sees by its pipe when that run ends.
            raise Orphaned("this run is over: another one has begun on this fabric")

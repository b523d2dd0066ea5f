"""Inbox: ticks, rosters, values and questions that came. One thread reads it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from threading import Timer

from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.roster import Entry, Roster
from rems_net.agents.tick import Tick
from rems_net.errors import WireError
from rems_net.router.mail import Mail, Mailbox, Presence, Question
from rems_net.router.message import read
from rems_net.router.session import Session

#: seconds a value may be late before it is asked for by its key
PATIENCE = 0.25
#: values kept of each key: its writer may be this much further, and a tick is needed
#: twice, by who reads it now and by who reads what was
KEEP = AHEAD + 2
#: seconds a clock may be out of sight: a router that is restarted takes some
GONE = 10.0


class Released(Exception):  # noqa: N818 - not an error: the clock let this host go
    """The roster no longer names this host."""


class Orphaned(Exception):  # noqa: N818 - not an error of this host
    """Whoever started this host is gone, or its clock is."""


class Inbox:
    """A host's mail, sorted.

    answer: called with a Question about values, at once.
    stop: called with what `rems/stop` says.
    warn: called with a sentence about what makes no sense.
    """

    def __init__(
        self,
        session: Session,
        name: str,
        answer: Callable[[Question], None],
        stop: Callable[[bool], None],
        warn: Callable[[str], None],
    ):
        self.session, self.name = session, name
        self.box = Mailbox()
        #: free-running values, by full key: the newest of each
        self.latest: dict[str, Mail] = {}
        #: where all agents here are free-running: each steps at every k-th tick
        self.rates: list[int] = []
        #: calls of verbs, which wait for the end of the tick
        self.calls: deque[Question] = deque()
        self._answer, self._stop, self._warn = answer, stop, warn
        self._stamped: dict[str, dict[int, bytes]] = {}
        self._ticks: deque[Tick] = deque()
        #: the newest tick that was heard with all before it
        self._newest = 0
        #: heard, and one before it was not
        self._early: dict[int, Tick] = {}
        #: the clock says a tick again: something is late, or was lost
        self.repeated = False
        self._rosters: dict[int, Roster] = {}
        self._admitted = False
        self._doom: Timer | None = None
        self._tick_key = session.key("clock", "tick")
        self._roster_key = session.key("clock", "roster")
        self._stop_key = session.key("stop")

    def watch(self) -> None:
        """Hear the clock."""
        for key in (self._tick_key, self._roster_key, self._stop_key):
            self.session.watch(key, self.box)
        self.session.watch_presence(self.session.key("clock", "@alive"), self.box)

    def read(self, timeout: float | None) -> bool:
        """Sort one letter; False when none came in time.

        Raises Released or Orphaned when it says so.
        """
        letter = self.box.get(timeout)
        if isinstance(letter, Mail):
            try:
                self._sort(letter)
            except (WireError, TypeError, ValueError) as error:
                # Anybody can put anything at a key; it ends no run.
                self._warn(f"what came at {letter.key} is passed over: {error}")
        elif isinstance(letter, Question):
            if "/@call/" in letter.key:
                self.calls.append(letter)
            else:
                self._answer(letter)
        elif isinstance(letter, Presence):
            self._see_clock(letter.alive)
        elif isinstance(letter, Orphaned):
            raise letter
        return letter is not None

    def _sort(self, mail: Mail) -> None:
        key = mail.key
        if key == self._tick_key:
            self._hear_tick(Tick(**read(mail.payload)))
        elif key == self._roster_key:
            self._file(Roster.from_wire(mail.payload))
        elif key == self._stop_key:
            self._stop(bool(read(mail.payload)))
        else:
            self.latest[key] = mail
            tick, _ = mail.stamp()
            if tick >= 0:
                kept = self._stamped.setdefault(key, {})
                # What was asked for comes more than once, and late.
                kept[tick] = mail.payload
                if len(kept) > KEEP:
                    del kept[min(kept)]

    def _see_clock(self, alive: bool) -> None:
        """A clock that stays away ends this host, wherever it was started."""
        if self._doom is not None:
            self._doom.cancel()
            self._doom = None
        if not alive:
            gone = Orphaned("the clock is gone")
            self._doom = Timer(GONE, self.box.put, [gone])
            self._doom.daemon = True
            self._doom.start()

    def begin(self, first: int) -> None:
        """Take part from tick `first` on."""
        self._newest = first - 1

    def _hear_tick(self, tick: Tick) -> None:
        if tick.n <= self._newest or tick.n in self._early:
            self.repeated = True
            return
        if self.rates:  # nobody waits for this host: what it did not hear is past
            self._newest = tick.n - 1
        self._early[tick.n] = tick
        while self._newest + 1 in self._early:
            self._newest += 1
            self._ticks.append(self._early.pop(self._newest))

    def _file(self, roster: Roster) -> None:
        newest = roster.epoch > max(self._rosters, default=-1)
        self._rosters[roster.epoch] = roster
        if not newest:  # one that was lost, and asked for
            return
        here = self.name in roster.hosts()
        if not here and (self._admitted or not roster.agents):
            raise Released
        self._admitted = self._admitted or here

    def next_tick(self) -> Tick | None:
        """The next tick; None when there is something to say first."""
        while not self._ticks:
            if self.calls or self.repeated:
                return None
            self.read(None)
        if self.rates:
            self._skip()
        return self._ticks.popleft()

    def _skip(self) -> None:
        """Free-running and too slow: pass over all but the newest tick to step at."""
        while not self.box.empty():
            self.read(0)
        due = [t for t in self._ticks if any(not t.n % k for k in self.rates)]
        keep = due[-1] if due else self._ticks[-1]
        while self._ticks[0] is not keep:
            self._ticks.popleft()

    def roster_of(self, epoch: int) -> Roster:
        """The roster that a tick names; asked for when it got lost.

        The clock keeps what those need that it waits for. Who is free-running may come
        too late for one, and takes the next.
        """
        while epoch not in self._rosters:
            if self.rates and max(self._rosters, default=-1) > epoch:
                break
            if self._nothing_comes():
                asked = f"{self._roster_key}?epoch={epoch}"
                self.session.ask_into(asked, self.box)
        for old in [e for e in self._rosters if e < epoch]:
            del self._rosters[old]
        return self._rosters[min(self._rosters)]

    def _nothing_comes(self) -> bool:
        """Wait for a letter; True when it is time to ask for what is missing."""
        if self.read(PATIENCE) and not self.repeated:
            return False
        self.repeated = False
        return True

    def value(self, key: str, n: int, writer: Entry) -> bytes | None:
        """The payload that `key` had at tick n; None once its writer has left.

        A value that does not come is asked for by its key: a lost message costs time,
        never a byte of the recording.
        """
        while True:
            payload = self._stamped.get(key, {}).get(n)
            if payload is not None:
                return payload
            now = self._rosters[max(self._rosters)].agents.get(writer.key)
            if now is None or now.since > n:  # gone, or another one of this name
                return None
            if self._nothing_comes():
                self.session.ask_into(f"{key}?since={n}", self.box)

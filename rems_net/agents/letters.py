"""What a host has been sent: ticks, rosters, values, questions. One thread reads it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from rems_net.agents.roster import Entry, Roster
from rems_net.agents.tick import Tick
from rems_net.router.message import read
from rems_net.router.session import Mail, Mailbox, Question, Session

#: seconds a value may be late before it is asked for by its key
PATIENCE = 0.25


class Released(Exception):  # noqa: N818 - not an error: the clock let this host go
    """The roster no longer names this host."""


class Orphaned(Exception):  # noqa: N818 - not an error of this host
    """Whoever started this host is gone."""


class Letters:
    """A host's mail, sorted.

    answer: called with a Question about values, at once.
    stop: called with what `rems/stop` says.
    """

    def __init__(
        self,
        session: Session,
        name: str,
        answer: Callable[[Question], None],
        stop: Callable[[bool], None],
    ):
        self.session, self.name = session, name
        self.box = Mailbox()
        #: free-running values, by full key: the newest of each
        self.latest: dict[str, Mail] = {}
        #: calls of verbs, which wait for the end of the tick
        self.calls: deque[Question] = deque()
        self._answer, self._stop = answer, stop
        self._stamped: dict[str, deque[tuple[int, bytes]]] = {}
        self._ticks: deque[Tick] = deque()
        self._rosters: dict[int, Roster] = {}
        self._admitted = False
        self._tick_key = session.key("clock", "tick")
        self._roster_key = session.key("clock", "roster")
        self._stop_key = session.key("stop")

    def watch(self) -> None:
        """Hear the clock."""
        for key in (self._tick_key, self._roster_key, self._stop_key):
            self.session.watch(key, self.box)

    def read(self, timeout: float | None) -> bool:
        """Sort one letter; False when none came in time.

        Raises Released or Orphaned when it says so.
        """
        letter = self.box.get(timeout)
        if isinstance(letter, Mail):
            self._sort(letter)
        elif isinstance(letter, Question):
            if "/@call/" in letter.key:
                self.calls.append(letter)
            else:
                self._answer(letter)
        elif isinstance(letter, Orphaned):
            raise letter
        return letter is not None

    def _sort(self, mail: Mail) -> None:
        key = mail.key
        if key == self._tick_key:
            self._ticks.append(Tick(**read(mail.payload)))
        elif key == self._roster_key:
            self._file(Roster.from_wire(mail.payload))
        elif key == self._stop_key:
            self._stop(bool(read(mail.payload)))
        else:
            self.latest[key] = mail
            tick, _ = mail.stamp()
            if tick >= 0:
                kept = self._stamped.setdefault(key, deque(maxlen=3))
                kept.append((tick, mail.payload))

    def _file(self, roster: Roster) -> None:
        self._rosters[roster.epoch] = roster
        here = self.name in roster.hosts()
        if not here and (self._admitted or not roster.agents):
            raise Released
        self._admitted = self._admitted or here

    def next_tick(self) -> Tick | None:
        """The next tick; None when there is a call to serve first."""
        while not self._ticks:
            if self.calls:
                return None
            self.read(None)
        return self._ticks.popleft()

    def roster_of(self, epoch: int) -> Roster:
        """The roster that a tick names; asked for when it got lost."""
        while epoch not in self._rosters:
            if not self.read(PATIENCE):
                self.session.ask_into(self._roster_key, self.box)
        for old in [e for e in self._rosters if e < epoch]:
            del self._rosters[old]
        return self._rosters[epoch]

    def value(self, key: str, n: int, writer: Entry) -> bytes | None:
        """The payload that `key` had at tick n; None once its writer has left.

        A value that does not come is asked for by its key: a lost message costs time,
        never a byte of the recording.
        """
        while True:
            for tick, payload in self._stamped.get(key, ()):
                if tick == n:
                    return payload
            if writer.key not in self._rosters[max(self._rosters)].agents:
                return None
            if not self.read(PATIENCE):
                self.session.ask_into(key, self.box)

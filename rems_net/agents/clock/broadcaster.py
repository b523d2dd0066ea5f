"""Broadcaster: publisher of a clock's ticks, rosters and STOP, with repetition."""

from collections import deque

from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.messages import pack_beat
from rems_net.agents.protocol.roster import Roster
from rems_net.agents.tick import Tick
from rems_net.router.keys import STEP
from rems_net.router.message import pack
from rems_net.router.session import Session


class Broadcaster:
    """Puts the ticks and rosters of one run, and whether STOP holds.

    stops: counts STOPs and their releases; odd means that STOP holds. It is a number,
    not a flag: a tick that was sent before a STOP came can never release it, because
    only a greater even number does.
    """

    def __init__(self, session: Session, run: int):
        self._session, self._run, self.stops = session, run, 0
        #: whether the clock reports STOP's sender; a router of this process does so
        self.reports = not session.link.behind
        #: ticks that may have to be sent again
        self._said: deque[Tick] = deque(maxlen=AHEAD)

    def open(self) -> None:
        """Declare the publishers."""
        session, key = self._session, self._session.key
        self._ticks = session.publisher(key("clock", STEP, "tick"))
        self._rosters = session.publisher(key("clock", STEP, "roster"))
        #: for programs that look, or that are not in lock-step
        self._shown = session.publisher(key("clock", "tick"), block=False)

    def publish_roster(self, roster: Roster) -> None:
        """Publish the members of the run."""
        self._rosters.put(roster.to_wire())

    def publish_tick(self, tick: Tick) -> None:
        """Publish a new tick, and whether STOP holds."""
        self._said.append(tick)
        self._put(tick)

    def repeat(self, done: int) -> None:
        """Publish every tick after `done` again: messages may be lost."""
        for tick in self._said:
            if tick.n > done:
                self._put(tick)

    def hold(self, stop: bool) -> bool:
        """Set whether STOP holds; return True if that changed. A router keeps it.

        A router that keeps a STOP which never came here forgets it at the release.
        """
        changed = stop != bool(self.stops % 2)
        self.stops += changed
        if changed or not stop:
            key = self._session.key("clock", "stops")
            self._session.put(key, pack([self._run, self.stops]))
        return changed

    def _put(self, tick: Tick) -> None:
        beat = pack_beat(self._run, tick, self.stops)
        self._ticks.put(beat)
        if self._shown.watched:
            self._shown.put(beat)

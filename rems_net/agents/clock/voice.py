"""Voice: what a clock publishes: ticks, rosters and STOP; again what may be lost."""

from collections import deque

from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.messages import pack_beat
from rems_net.agents.protocol.roster import Roster
from rems_net.agents.tick import Tick
from rems_net.router.keys import STEP
from rems_net.router.message import pack
from rems_net.router.session import Session


class Voice:
    """Puts the ticks and rosters of one run, and whether STOP holds.

    stops: how often STOP was said and released; odd means that it holds. A number, not
    a flag: a tick that was sent before a STOP was heard can never release it, for only
    a greater even number does.
    """

    def __init__(self, session: Session, run: int):
        self._session, self._run, self.stops = session, run, 0
        #: whether the clock reports who has said STOP; a router of this process does so
        self.reports = not session.link.behind
        #: those that may have to be said again
        self._said: deque[Tick] = deque(maxlen=AHEAD)

    def open(self) -> None:
        """Be able to speak."""
        session, key = self._session, self._session.key
        self._ticks = session.publisher(key("clock", STEP, "tick"))
        self._rosters = session.publisher(key("clock", STEP, "roster"))
        #: for whoever is not in lock-step, or looks
        self._shown = session.publisher(key("clock", "tick"), block=False)

    def say_roster(self, roster: Roster) -> None:
        """Say who takes part."""
        self._rosters.put(roster.to_wire())

    def say_tick(self, tick: Tick) -> None:
        """Say a new tick, and whether STOP holds."""
        self._said.append(tick)
        self._put(tick)

    def say_again(self, done: int) -> None:
        """Say every tick after `done` again: it, or an answer to it, may be lost."""
        for tick in self._said:
            if tick.n > done:
                self._put(tick)

    def hold(self, stop: bool) -> bool:
        """Let STOP hold, or not; True if it was otherwise. A router keeps it."""
        changed = stop != bool(self.stops % 2)
        self.stops += changed
        if changed:
            key = self._session.key("clock", "stops")
            self._session.put(key, pack([self._run, self.stops]))
        return changed

    def _put(self, tick: Tick) -> None:
        beat = pack_beat(self._run, tick, self.stops)
        self._ticks.put(beat)
        if self._shown.watched:
            self._shown.put(beat)

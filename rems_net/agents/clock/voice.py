"""Voice: what a clock says: ticks and rosters, and again what may have got lost."""

from __future__ import annotations

from collections import deque

from rems_net.agents.clock.latch import Latch
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.messages import pack_beat
from rems_net.agents.protocol.roster import Roster
from rems_net.agents.tick import Tick
from rems_net.router.keys import STEP
from rems_net.router.session import Session


class Voice:
    """Puts the ticks and rosters of one run."""

    def __init__(self, session: Session, run: int, latch: Latch):
        self._session, self._run, self._latch = session, run, latch
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

    def _put(self, tick: Tick) -> None:
        beat = pack_beat(self._run, tick, self._latch.stops)
        self._ticks.put(beat)
        if self._shown.watched:
            self._shown.put(beat)

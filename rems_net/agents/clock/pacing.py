"""Pacing: when ticks come, by deadlines and by people's commands."""

import time
from collections import defaultdict
from collections.abc import Callable, Set

from rems_net.agents.protocol.limits import AHEAD, check_pace
from rems_net.agents.tick import Tick, time_of
from rems_net.agents.verbs import verb
from rems_net.errors import ExperimentError, FabricError
from rems_net.events import info

#: s. If a tick is later than this, real time starts again from this tick.
LATE = 0.1
#: s. Lost time, at once or bit by bit, that is reported.
TOLD = 1.0
#: s. Shortest time between two reports, if a machine is always too slow.
AGAIN = 10.0
#: Number of sets of hosts for which waiting times are counted.
BLAMED = 1_000
NEEDS_PACE = (
    "the clock of an open fabric does not wait for agents, so it needs a pace; "
    "expected one above 0, such as 1. (R0433)"
)


class Pacing:
    """Makes the ticks of `dt` seconds, in time. Its verbs are those of the clock.

    factor: of real time; 0.0 is as fast as the slowest host.  waits_for_nobody: as the
    clock of an open fabric does.
    """

    def __init__(self, dt: float, factor: float, *, waits_for_nobody: bool = False):
        self.dt, self.factor = dt, factor
        self.waits_for_nobody = waits_for_nobody
        self.paused = False
        self.ended = False
        #: the newest tick
        self.tick = Tick(0, 0.0, dt, factor)
        self._steps = 0
        self._anchor = 0.0
        #: s. Real time that was lost since the last report.
        self._lost = 0.0
        self._told = -AGAIN
        #: s. Time that ticks were waited for, by the hosts that had not done them.
        self._waited: defaultdict[frozenset[str], float] = defaultdict(float)
        #: names such hosts, and their lines of code
        self.naming: Callable[[Set[str]], str] = ", ".join

    @property
    def n(self) -> int:
        """The newest tick's number."""
        return self.tick.n

    @property
    def held(self) -> bool:
        """Whether no tick may be made for now."""
        return self.paused and not self._steps and not self.ended

    def left(self) -> float:
        """Return the seconds until the next tick is due; the deadlines never drift."""
        if not self.factor or self.paused or self.ended:
            return 0.0
        return self._anchor + (self.n + 1) * self.dt / self.factor - time.monotonic()

    def ahead(self) -> int:
        """Return how many ticks may be sent of which the first is not done.

        At a pace it is one. If the tick after the next one is due already, it is as
        many as last LATE s: on a busy machine, each message waits for a processor. No
        tick is early, and after a hold no robot hurries for longer than that.
        """
        if not self.factor:
            return AHEAD
        if self.left() > -self.dt / self.factor:
            return 1
        return max(1, min(AHEAD, int(LATE * self.factor / self.dt)))

    def make(self, epoch: int) -> Tick:
        """Make the next tick, at which the roster `epoch` holds."""
        n = self.tick.n + 1
        if self.factor:
            self._stay_real()
        self.tick = Tick(n, time_of(n, self.dt), self.dt, self.factor, epoch)
        if self._steps:
            self._steps -= 1
        return self.tick

    def _stay_real(self) -> None:
        """Let real time go on from the next tick, if that is late."""
        late = -self.left()
        if late > max(2 * self.dt / self.factor, LATE):
            # A robot must not run through the time of a hold in fast forward.
            self._anchor += late
            self._lost += late
            now = time.monotonic()
            if self._lost > TOLD and now - self._told > AGAIN:
                text = f"{self._lost:.1f} s late: real time goes on from here"
                hosts = max(self._waited, key=self._waited.__getitem__, default=None)
                if hosts and (who := self.naming(hosts)):
                    text += f"; ticks waited {self._waited[hosts]:.1f} s for {who}"
                info("late", text)
                self._lost, self._told = 0.0, now
                self._waited.clear()

    def blame(self, hosts: frozenset[str], seconds: float) -> None:
        """Note for how long a tick was waited for, and for which hosts."""
        if len(self._waited) < BLAMED or hosts in self._waited:
            self._waited[hosts] += seconds

    def set(self, factor: float) -> None:
        """Set the factor from now on; the newest tick counts as in time."""
        self.factor = factor
        if factor:
            self._anchor = time.monotonic() - self.n * self.dt / factor

    @verb
    def pause(self) -> int:
        """Make no more ticks for now. Returns the newest tick."""
        self.paused, self._steps = True, 0
        return self.n

    @verb
    def resume(self) -> int:
        """Go on ticking. Returns the newest tick."""
        self.paused = False
        self.set(self.factor)
        return self.n

    @verb
    def step(self, count: int = 1) -> int:
        """While paused, make `count` ticks. Returns the tick before the first."""
        if isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise FabricError(
                f"step by {count!r}; expected a whole number from 1 (R0408)"
            )
        self.paused = True
        self._steps += count
        return self.n

    @verb
    def pace(self, pace: float | str) -> float:
        """Set the real-time factor, 0.001 to 10,000.

        "fast" is as fast as the slowest host; an open fabric has no such pace.
        """
        factor = check_pace(pace, self.dt)
        if not factor and self.waits_for_nobody:
            raise ExperimentError(NEEDS_PACE)
        self.set(factor)
        return factor

    @verb
    def end(self) -> int:
        """End the run after this tick, as if its duration were over."""
        self.ended = True
        return self.n

"""What the programs that run rems_net share: who subscribes, and who notes the time."""

from __future__ import annotations

import tempfile
import time
from typing import Any

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.show import Show
from rems_net.router.mail import Mailbox


class Tally(Mailbox):
    """Notes when something came, and keeps nothing of it."""

    def __init__(self) -> None:
        super().__init__()
        self.times: list[float] = []
        self.put = self._note

    def _note(self, item: Any) -> None:
        self.times.append(time.perf_counter())

    def rate(self, each: int = 1) -> float:
        """Ticks per second after the first fifth, where a tick is `each` letters."""
        ticks = len(self.times) // each
        warm = max(1, ticks // 5)
        return (ticks - warm) / (self.times[-1] - self.times[warm * each - 1])


class Watcher(Show):
    """Subscribes to some keys, without the fabric, in the process that ticks."""

    def __init__(self, *keys: str):
        self.tallies = {key: Tally() for key in keys}
        self.clock: Clock | None = None

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        self.clock = clock
        for key, tally in self.tallies.items():
            clock.session.watch(clock.session.key(key), tally)


def go(lab: Experiment, watcher: Show, pace: float | str = "fast") -> None:
    """Run it in a folder that is gone afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        lab.run(folder, pace=pace, show=watcher)

"""Ticks at which an agent has a row: those of a CSV file that was written as it ran."""

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.mcap.reader import McapFile

#: fraction of its ticks. A device writes less often: it has a value now and then.
OFTEN = 0.5


class Span:
    """Ticks at which an agent has a row.

    They are those of its messages, and those between two of its steps. They do not go
    beyond a gap, which a recorder leaves that is started again. A device has a row at
    each tick.
    """

    def __init__(self, file: McapFile, agent: str) -> None:
        kind, _, name = agent.partition("/")
        counts = [n for k, n in file.counts.items() if k.rpartition("/")[0] == agent]
        self._step, since, dt, known = 1, 0.0, file.told.dt, False
        for plan in file.told.agents.get(kind, ()):
            if plan.get("name") == name:
                self._step, since = plan.get("every", 1), plan.get("since", 0.0)
                known = True
        self._last = file.last
        self._first = round(since / dt) + 1 if dt else 0
        steps = (self._last - self._first + 1) // self._step
        self._device = max(counts, default=0) < OFTEN * steps
        self._end = self._first + self._step - 1 if dt else 0
        if not known:  # it has joined an open fabric, at its first message
            self._first, self._end, self._device = 0, 0, False

    def written(self, n: int) -> None:
        """Note that the agent has written at tick n."""
        self._first, self._end = min(self._first, n) or n, n + self._step

    def has(self, n: int) -> bool:
        """Return whether tick n has a row, after the messages until then."""
        return n >= self._first and (self._device or n < self._end)

    def rows(self, ticks: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return all ticks with a row (m,), from those with a message (n,), rising."""
        first = min(self._first, ticks[0])
        if self._device:
            return np.arange(first, self._last + 1, dtype=np.float64)
        near = ticks[:, None] + np.arange(self._step)
        early = np.arange(self._first, self._end)
        made = np.union1d(near.ravel(), early)
        return made[made <= self._last]

"""One step of fabric time, made by the clock and by nobody else."""

from __future__ import annotations

from typing import Any, NamedTuple


class Tick(NamedTuple):
    """Step number `n`, which covers fabric time (t - dt, t].

    n: 1, 2, 3, ...        t: seconds at the END of the step (n * dt, so no drift)
    dt: seconds            pace: real-time factor, 0.0 means as fast as possible
    epoch: of the roster that holds at this tick
    """

    n: int
    t: float
    dt: float
    pace: float = 0.0
    epoch: int = 0

    def to_plain(self) -> dict[str, Any]:
        """What goes over the wire."""
        return self._asdict()

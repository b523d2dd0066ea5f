"""History: when the last ticks were made, so that anybody may ask how old one is."""

from __future__ import annotations

from rems_net.agents.wall import wall

#: ticks that are remembered: more than half a second of the fastest clock
LAST = 16_384


class History:
    """When each of the last ticks was made, in wall time. Asked from any thread."""

    def __init__(self) -> None:
        self._made = [float("-inf")] * LAST
        self._newest = 0

    def note(self, n: int) -> None:
        """Tick `n` is made now."""
        self._made[n % LAST] = wall()
        self._newest = n

    def age(self, n: int) -> float:
        """Seconds since tick `n` was made; infinite for one that is not known."""
        if not self._newest - LAST < n <= self._newest:
            return float("inf")
        return wall() - self._made[n % LAST]

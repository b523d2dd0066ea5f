"""Progress of a sweep: how many runs are over, and the time that is left."""

import sys
import time
from collections.abc import Callable

#: s. Time between two lines; a terminal has one line, which changes ten times as often.
SPARSE = 5.0


class Progress:
    """Progress of a sweep of `runs` runs, of which some were there before.

    put: prints a line; without it, nothing is shown.
    """

    def __init__(self, runs: int, before: int, put: Callable[[str], object] | None):
        self.runs, self.over, self.failed = runs, before, 0
        self._before, self._put = before, put
        self._live = put is not None and sys.stderr.isatty()
        self._began = self._last = time.monotonic()

    def add(self, failed: bool) -> None:
        """Count a run that is over."""
        self.over += 1
        self.failed += failed

    def look(self) -> None:
        """Show it, if it is time to."""
        now = time.monotonic()
        if self._put is None or now - self._last < SPARSE / (10 if self._live else 1):
            return
        self._last = now
        if self._live:
            print(f"\r{self}\x1b[K", end="", file=sys.stderr, flush=True)
        else:
            self._put(str(self))

    def end(self) -> None:
        """Show the end."""
        if self._live:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
        if self._put is not None:
            self._put(str(self))

    def __str__(self) -> str:
        """Return `117 of 180 runs, 1 failed, 3.1 a second, 20 s left`."""
        made = self.over - self._before
        spent = max(time.monotonic() - self._began, 1e-9)
        parts = [f"{self.over} of {self.runs} runs"]
        parts += [f"{self.failed} failed"] * (self.failed > 0)
        if made and self.over < self.runs:
            rate = made / spent
            parts += [f"{rate:.3g} a second", f"{left((self.runs - self.over) / rate)}"]
        elif made:
            parts.append(f"in {spent:.1f} s")
        return ", ".join(parts)


def left(seconds: float) -> str:
    """Return `20 s left`, `3 min left` or `2.5 h left`."""
    if seconds < 90:
        return f"{seconds:.0f} s left"
    if seconds < 5400:
        return f"{seconds / 60:.0f} min left"
    return f"{seconds / 3600:.1f} h left"

"""Wall time that goes on while a laptop sleeps: what a robot's safety counts in."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable


def _clock() -> Callable[[], float]:
    """Linux: since boot, suspend included. macOS: its monotonic clock counts sleep
    where Python's own does not. Windows: Python's own counts it.
    """
    number = getattr(time, "CLOCK_BOOTTIME", None)
    if number is None and sys.platform == "darwin":
        number = getattr(time, "CLOCK_MONOTONIC", None)
    if number is None:
        return time.monotonic
    return lambda: time.clock_gettime(number)


#: seconds, from some beginning; never goes back
now = _clock()

"""Wall: for how long something has lasted, in wall time, the machine's sleep included.

`time.monotonic` stands still while a laptop sleeps on Linux and macOS: a command of
before its lid was closed would be fresh when it is opened.
"""

import sys
import time

_CLOCK: int | None
if sys.platform == "linux":
    _CLOCK = time.CLOCK_BOOTTIME
elif sys.platform == "darwin":
    _CLOCK = time.CLOCK_MONOTONIC  # there it counts sleep, and time.monotonic does not
else:
    _CLOCK = None  # on Windows time.monotonic counts sleep


def wall() -> float:
    """Return seconds since some moment of this machine; never steps back, or stops."""
    return time.monotonic() if _CLOCK is None else time.clock_gettime(_CLOCK)

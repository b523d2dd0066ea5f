"""Wall: durations in wall time that include the machine's sleep.

`time.monotonic` stands still while a laptop sleeps on Linux and macOS: a command from
before its lid was closed would seem fresh when it is opened.
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
    """Return the seconds since a fixed moment; the count never stops."""
    return time.monotonic() if _CLOCK is None else time.clock_gettime(_CLOCK)

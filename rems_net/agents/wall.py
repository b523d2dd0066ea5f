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
    # On Windows both clocks count sleep. A command and the fault before it can be in
    # one step of time.monotonic, which is 16 ms; the other clock's is below 1 us.
    _CLOCK = None


def wall() -> float:
    """Return the seconds since a fixed moment; the count never stops."""
    return time.perf_counter() if _CLOCK is None else time.clock_gettime(_CLOCK)

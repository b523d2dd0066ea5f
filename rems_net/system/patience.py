"""Patience with files that another program has open for a moment.

On Windows nobody moves or writes a file that a program holds for itself, and a virus
scanner holds each new file for up to a second.
"""

import sys
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

#: s. A file that is held for longer is reported; pause between two tries.
PATIENCE, PAUSE = 2.0, 0.05


def patiently(action: Callable[[], T]) -> T:
    """Return action(), tried again on Windows while it raises PermissionError."""
    until = time.monotonic() + (PATIENCE if sys.platform == "win32" else 0.0)
    while True:
        try:
            return action()
        except PermissionError:
            if time.monotonic() >= until:
                raise
        time.sleep(PAUSE)

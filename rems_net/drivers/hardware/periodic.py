"""Periodic: deadlines at a device's rate, and statistics of delays.

Deadlines are absolute, so that no error adds up. Missed deadlines are passed over:
late exchanges are not made up for.
"""

import time
from threading import Event

from rems_net.agents.wall import wall


class Periodic:
    """Deadlines every `period` seconds, with statistics of delays.

    missed: deadlines that were passed over.  worst: the longest delay, in s.
    """

    def __init__(self, period: float):
        self.period = period
        self.missed = 0
        self.worst = 0.0
        self._due = wall()

    def restart(self) -> None:
        """Count from now on: earlier time is no delay."""
        self._due = wall()

    def wait(self, ending: Event) -> bool:
        """Wait for the next deadline; return False if `ending` is set by then."""
        self._due += self.period
        while (left := self._due - wall()) > 0:
            # Not ending.wait: on Windows that is 15 ms late.
            time.sleep(left)
        self.worst = max(self.worst, -left)
        passed = int(-left / self.period)
        self.missed += passed
        self._due += passed * self.period
        return not ending.is_set()

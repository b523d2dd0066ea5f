"""Periodic: deadlines of a device that is to be served at a rate, and how late it was.

Absolute deadlines, so that no error adds up. One that is missed is passed over: what
comes late is not made up for by haste.
"""

import time
from threading import Event

from rems_net.agents.wall import wall


class Periodic:
    """Waits for every `period` seconds, and counts what was late.

    missed: deadlines that were passed over.  worst: how late the latest was, in s.
    """

    def __init__(self, period: float):
        self.period = period
        self.missed = 0
        self.worst = 0.0
        self._due = wall()

    def restart(self) -> None:
        """Count from now on: what was before is nobody's lateness."""
        self._due = wall()

    def wait(self, ending: Event) -> bool:
        """Wait for the next deadline; False if `ending` is set by then."""
        self._due += self.period
        while (left := self._due - wall()) > 0:
            # Not ending.wait: on Windows that is 15 ms late.
            time.sleep(left)
        self.worst = max(self.worst, -left)
        passed = int(-left / self.period)
        self.missed += passed
        self._due += passed * self.period
        return not ending.is_set()

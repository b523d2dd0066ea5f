"""Show: what a run shows while it runs; its caller may give another."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rems_net.events import Event

if TYPE_CHECKING:
    from rems_net.agents.clock.clock import Clock


class Show:
    """Shows a run while it runs; this one shows events, and no more."""

    #: set once the agents are being started
    clock: Clock | None = None

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        """Take in that agents are being started; `clock` may be looked at."""
        self.clock = clock

    def say(self, source: str, event: Event) -> None:
        """Show an event. source: the host that reports it, or "clock" or "run"."""
        print(f"[{source}] {event}", file=sys.stderr)

    def end(self) -> None:
        """The run is over."""

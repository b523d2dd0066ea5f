"""Show: the display of a run; a caller may give another."""

import sys
from dataclasses import astuple
from typing import TYPE_CHECKING

from rems_net.events import Event
from rems_net.router.message import pack

if TYPE_CHECKING:
    from rems_net.agents.clock.clock import Clock
    from rems_net.router.session import Session


class Show:
    """Display of a run. This one prints events, and no more."""

    #: set once the agents are being started
    clock: "Clock | None" = None

    def begin(self, clock: "Clock", ticks: int, endpoint: str) -> None:
        """Note that agents are being started; the display may read `clock`."""
        self.clock = clock

    def say(self, source: str, event: Event) -> None:
        """Show an event. source: the host that reports it, or "clock" or "run"."""
        print(f"[{source}] {event}", file=sys.stderr)

    def end(self) -> None:
        """End the display: the run is over."""


class Reports:
    """Publisher of a run's events at `clock/@event`, for programs that look."""

    def __init__(self, session: "Session"):
        key = session.key("clock", "@event")
        self._publisher = session.publisher(key, block=False)

    def put(self, event: Event) -> None:
        """Put `[level, tick, agent, kind, text]`, if a program looks."""
        if self._publisher.watched:
            self._publisher.put(pack(astuple(event)))

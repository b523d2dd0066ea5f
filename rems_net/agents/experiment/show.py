"""Show: what a run tells while it runs; whoever starts one may give another."""

from __future__ import annotations

import sys

from rems_net.agents.clock.clock import Clock


class Show:
    """What a run tells while it runs; this one says warnings and prints, no more."""

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        """The agents are being started; `clock` may be looked at from now on."""

    def say(self, source: str, line: str) -> None:
        """An agent printed a line."""
        print(f"[{source}] {line}", file=sys.stderr)

    def end(self) -> None:
        """The run is over."""

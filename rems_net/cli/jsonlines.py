"""JSON lines: a run in a format for programs, one JSON object a line on stdout."""

import json
import sys
from contextlib import suppress
from dataclasses import asdict
from typing import Any

from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.folder import Result
from rems_net.agents.experiment.show import Show
from rems_net.errors import AgentError
from rems_net.events import Event

#: fields for each two robots: m, rad and s, as in a recording's `compare()`
PAIR = ("a", "b", "rms", "final", "rms_turn", "final_turn", "parted")


class JsonLines(Show):
    """Display that prints each event as an object, and the report at the end.

    Without a reader the lines are lost, and the run goes on.
    """

    def __init__(self) -> None:
        self._stdout = sys.stdout

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        """Report the fabric's endpoint, which other commands take as `--at`."""
        super().begin(clock, ticks, endpoint)
        self.say("run", Event("info", 0, "run", "begun", f"fabric at {endpoint}"))

    def say(self, source: str, event: Event) -> None:
        """Print an event."""
        self._print(event)

    def failed(self, error: BaseException) -> None:
        """Report why the run ended early."""
        agent = error.agent if isinstance(error, AgentError) else "run"
        tick = self.clock.done if self.clock else 0
        text = str(error) or "interrupted"
        self.say("run", Event("error", tick, agent, "failed", text))

    def report(self, result: Result) -> None:
        """Print the report: an event with more fields."""
        files = [str(path) for path in (*result.files, *result.others)]
        text = f"{len(files)} files in {result.folder}"
        pairs = result.pairs(result.trajectories())
        apart = [{name: getattr(pair, name) for name in PAIR} for pair in pairs]
        event = Event("info", result.ticks, "run", "report", text)
        self._print(event, folder=str(result.folder), files=files, pairs=apart)

    def _print(self, event: Event, **more: Any) -> None:
        with suppress(OSError):
            print(json.dumps(asdict(event) | more), file=self._stdout, flush=True)

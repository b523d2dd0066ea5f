"""Display of a run in progress: a live picture on a terminal, else sparse lines."""

import sys
import threading
import time
from typing import Any

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.show import Show
from rems_net.events import Event

#: s. Time between lines if the output is not a terminal.
SPARSE = 5.0
#: Number of agents that are shown.
MANY = 20


def usual(name: str) -> Show:
    """Return the display of a script's run: the picture if stdout is a terminal."""
    if sys.stdout is not None and sys.stdout.isatty():
        return Progress(name, Console(highlight=False, markup=False))
    return Show()


class Progress(Show):
    """Fabric time, speed, and one line per agent."""

    def __init__(self, name: str, console: Console):
        self.name, self.console = name, console
        self.ticks = 0
        self._live: Live | None = None
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        """Start the display."""
        self.clock, self.ticks = clock, ticks
        self._began = time.monotonic()
        pace = clock.tick.pace
        speed = f"{pace:g} x real time" if pace else "as fast as possible"
        self.console.print(
            f"{self.name}: {ticks * clock.dt:g} s of fabric time, {speed}; "
            f"fabric at {endpoint}."
        )
        if self.console.is_terminal:
            self._live = Live(
                get_renderable=self._picture,
                console=self.console,
                refresh_per_second=8,
                transient=True,
            )
            self._live.start()
        else:
            self._thread = threading.Thread(target=self._lines, daemon=True)
            self._thread.start()

    def say(self, source: str, event: Event) -> None:
        """Print an event, above the picture."""
        self.console.print(Text.assemble((f"[{source}] ", "dim"), str(event)))

    def end(self) -> None:
        """Remove the picture, and print how far the run came."""
        self._over.set()
        if self._live is not None:
            self._live.stop()
        if self._thread is not None:
            self._thread.join()
        if self.clock is not None and self.clock.tick.n:
            self.console.print(self.summary())

    def summary(self) -> str:
        """Return how far the run came: `12.0 s of 12.0 s in 3.1 s, 3.9 x real time`."""
        assert self.clock is not None
        began = self.clock.started or self._began
        spent = max(time.monotonic() - began, 1e-9)
        done = self.clock.done * self.clock.dt
        return (
            f"{done:.1f} s of {self.ticks * self.clock.dt:.1f} s in {spent:.1f} s, "
            f"{done / spent:.1f} x real time"
        )

    def _lines(self) -> None:
        while not self._over.wait(SPARSE):
            self.console.print(self.summary())

    def _picture(self) -> RenderableType:
        clock = self.clock
        if clock is None or not clock.started:
            return Text("starting the agents ...", style="dim")
        bar = ProgressBar(total=self.ticks, completed=clock.done, width=24)
        head = Table.grid(padding=(0, 2))
        head.add_row(bar, self.summary())
        return Group(head, agents_table(clock.status()[:MANY]))


def agents_table(status: list[dict[str, Any]]) -> Table:
    """Return a table with one line per agent: its name, host, rate and tick."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for name in ("agent", "host"):
        table.add_column(name)
    for name in ("rate", "tick"):
        table.add_column(name, justify="right")
    for row in status:
        table.add_row(
            row["agent"],
            Text(row["host"], style="dim"),
            f"{row['rate']:.0f} Hz",
            str(row["tick"]),
        )
    return table

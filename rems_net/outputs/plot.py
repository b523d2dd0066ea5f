"""PlotOutput: a live figure of a run, in a window of its own."""

import json
import os
import subprocess
import sys
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from threading import Event, Thread
from typing import IO, Any

from rems_net.agents.agent import Output
from rems_net.agents.ports import In, Settings
from rems_net.agents.tick import Tick
from rems_net.defdict import Schema, text
from rems_net.errors import AgentError, nearest
from rems_net.events import warn

#: ticks that may wait for the window; of more, the newest are kept
WAITING = 1000
#: s. The thread that writes to the window rests so long between two batches of rows.
REST = 0.03
#: s. The window has this long to draw the last values, and to close.
LAST = 3.0


class PlotOutput(Output):
    """Shows values while they are made; after the run, `rems plot` draws them.

    fields: such as `["robot/sim/state/x"]`, drawn over time. Without it, the paths of
    all robots whose state has `x` and `y`.

    A run never waits for it, and the window is a process of its own: both take the
    newest values, and leave out what they are too slow for. Without a display, or
    without matplotlib, one sentence is printed, and the run goes on.
    """

    lockstep = False

    options = Settings(fields=text(max_len=65_536))
    inputs = In(source="input/*/*")
    robots = In(source="robot/*/*")
    processes = In(source="process/*/*")

    def __init__(self, name: str, *, options: Any = None, **more: Any):
        given = dict(options or {})
        if isinstance(given.get("fields"), list | tuple):
            given["fields"] = ", ".join(map(str, given["fields"]))
        super().__init__(name, options=given, **more)

    def open(self) -> None:
        """Have no window yet: what to draw is known at the first tick."""
        self._places: list[tuple[str, str]] = []
        self._window: _Window | None = None

    def write(self, tick: Tick) -> None:
        """Hand the values of this tick to the window."""
        read: Any = {**self.inputs, **self.robots, **self.processes}
        if not self._places:
            self._begin({key: value.schema for key, value in read.items()})
        if self._window is not None:
            row = [read[k][path] if k in read else None for k, path in self._places]
            if trouble := self._window.put([tick.t, *row]):
                self._window = None
                warn("display", f"{self.key}: {trouble}; the run goes on", self.key)

    def _begin(self, ports: Mapping[str, Schema]) -> None:
        named = self._named(ports)
        self._places = named or _paths(ports)
        if not self._places:
            return
        units = [dict(ports[k].rows())[path].unit for k, path in self._places]
        if not _has_display():
            text = f"{self.key}: there is no display here, so no figure is shown"
            warn("display", f"{text}; `rems plot` draws the recording", self.key)
            return
        names = [f"{key}/{path}" for key, path in self._places]
        head = {"title": self.key, "names": names, "units": units, "paths": not named}
        self._window = _Window(head)

    def close(self) -> None:
        """Close the window."""
        if self._window is not None:
            self._window.close()

    def expected(self, ports: Mapping[str, Schema]) -> list[str]:
        """Return no file: it leaves none. Raises AgentError for an unknown field."""
        self._named(ports)
        return []

    def _named(self, ports: Mapping[str, Schema]) -> list[tuple[str, str]]:
        """Return ports and paths of the fields. Raises AgentError."""
        fields = self.options.fields.replace(",", " ").split()
        return [_place(one, ports, self.key) for one in fields]


class _Window:
    """The process with the window, and the thread that starts it and writes to it."""

    def __init__(self, head: dict[str, Any]):
        self._rows: deque[list[Any]] = deque(maxlen=WAITING)
        self._new, self._end = Event(), Event()
        self._head, self._why = head, ""
        self._process: subprocess.Popen[bytes] | None = None
        self._thread = Thread(target=self._live, daemon=True)
        self._thread.start()

    def put(self, row: list[Any]) -> str:
        """Hand a row over, and return at once: why nothing is shown any more, or ""."""
        self._rows.append(row)
        self._new.set()
        return "" if self._thread.is_alive() else self._why

    def _live(self) -> None:
        words = [sys.executable, "-m", "rems_net.outputs.window"]
        try:
            with subprocess.Popen(
                [*words, json.dumps(self._head)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            ) as process:
                self._process = process
                assert process.stdin is not None
                assert process.stdout is not None
                with suppress(OSError):  # the window is closed
                    self._write(process.stdin)
                with suppress(OSError):
                    process.stdin.close()
                why = process.stdout.read().decode(errors="replace").strip()
        except OSError as error:
            why = f"its window cannot be started: {error.strerror}"
        self._why = why or "its window was closed"

    def _write(self, pipe: IO[bytes]) -> None:
        while not self._end.is_set() or self._rows:
            self._new.wait()
            self._new.clear()
            while self._rows:
                pipe.write(json.dumps(self._rows.popleft()).encode() + b"\n")
            pipe.flush()
            self._end.wait(REST)

    def close(self) -> None:
        """Let the window draw what it has, and end it."""
        self._end.set()
        self._new.set()
        self._thread.join(LAST)
        if self._process is not None and self._thread.is_alive():
            self._process.kill()
        self._thread.join(LAST)


def _has_display() -> bool:
    """Return whether windows can be shown here, by what the system has set."""
    if sys.platform in ("win32", "darwin"):
        return True
    return any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))


def _place(named: str, ports: Mapping[str, Schema], agent: str) -> tuple[str, str]:
    """Return port and path of a field. Raises AgentError for what is no number."""
    key, path = "/".join(named.split("/")[:3]), "/".join(named.split("/")[3:])
    every = [f"{k}/{p}" for k, schema in ports.items() for p in numbers(schema)]
    if named not in every:
        raise AgentError(
            agent,
            f"there is no number {named!r} to be drawn; expected such as "
            f"{', '.join(every[:3]) or 'nothing: no agent writes one'}."
            f"{nearest(named, every)} (R0104)",
        )
    return key, path


def _paths(ports: Mapping[str, Schema]) -> list[tuple[str, str]]:
    """Return x and y of each robot that has them in its state."""
    states = [
        key for key in ports if key.startswith("robot/") and key.endswith("state")
    ]
    return [
        (key, path)
        for key in states
        if {"x", "y"} <= {*numbers(ports[key])}
        for path in ("x", "y")
    ]


def numbers(schema: Schema) -> list[str]:
    """Return the paths of the fields that are single numbers."""
    value = schema()
    rows = schema.rows()
    return [p for p, one in rows if not one.shape and type(value[p]) in (float, int)]

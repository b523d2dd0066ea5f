"""What the tests of whole runs share: waiting, watching over processes, routers."""

import hashlib
import os
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.show import Show
from rems_net.client import join
from rems_net.errors import FabricError
from rems_net.events import Event
from tests.signals import KILLED
from tests.windows import processes

PARTS = Path(__file__).parent
#: how rems_net reports that a process was killed
WAS_KILLED = KILLED if sys.platform == "win32" else f"was {KILLED}"
#: in what a busy machine says by itself: held ticks, lost real time
BUSY = (" is held by ", " late: real time goes on from here")
#: how long a program waited for a core, of all time since the machine started [us]
PRESSURE = Path("/proc/pressure/cpu")
#: s. How long Wine keeps the port of a killed program with connections, at most
KEPT = 90.0
#: how many times as long a test waits on a machine that is never calm
LONGEST = 4.0


def quiet(text: str) -> str:
    """A program's lines without what a busy machine says by itself."""
    lines = text.splitlines(keepends=True)
    return "".join(line for line in lines if not any(b in line for b in BUSY))


def calm() -> float:
    """Seconds on a clock that stands still while a program here waits for a core.

    So a limit on what a test has started says nothing of what else the machine does.
    Linux counts how long somebody waited; where nobody does, it is the plain time.
    """
    try:
        some = PRESSURE.read_text(encoding="ascii").split("\n")[0]
    except OSError:
        return time.monotonic()
    return time.monotonic() - int(some.rpartition("=")[2]) / 1e6


def until(condition: Callable[[], Any], seconds: float = 20.0) -> Any:
    """What `condition` returns, once it is true: within these calm seconds."""
    begun, last = calm(), time.monotonic() + LONGEST * seconds
    pause = threading.Event()
    while calm() - begun < seconds and time.monotonic() < last:
        if found := condition():
            return found
        pause.wait(0.02)
    raise AssertionError("did not come true in time")


def ticking(ticks: int = 1) -> list[dict[str, Any]]:
    """Who is on the fabric that a test can find, once all made this many ticks."""

    def look() -> list[dict[str, Any]]:
        with suppress(FabricError), join() as fabric:
            found = fabric.agents()
            return found if all(agent["tick"] >= ticks for agent in found) else []
        return []  # it is not there yet

    found: list[dict[str, Any]] = until(look, 30)
    return found


def alive(pid: int) -> bool:
    """Whether a process runs; one that nobody has reaped yet does not."""
    if sys.platform == "win32":
        return processes.alive(pid)
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8")
    except OSError:
        return False
    return status.rpartition(") ")[2][0] != "Z"


def relatives(mark: str) -> list[int]:
    """The processes whose environment holds `mark`: our own children, wherever."""
    found = []
    if sys.platform == "win32":
        for pid in processes.pythons():
            with suppress(OSError):
                marked = mark in processes.environment_of(pid)
                if marked and pid != os.getpid() and alive(pid):
                    found.append(pid)
        return found
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit() and int(folder.name) != os.getpid():
            try:
                environment = (folder / "environ").read_bytes()
            except OSError:
                continue
            if mark.encode() in environment and alive(int(folder.name)):
                found.append(int(folder.name))
    return found


def digest(folder: Path) -> str:
    """One SHA-256 over the names and the bytes of all files of a run.

    Its pace, which is in its manifest alone, does not count.
    """
    total = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            total.update(path.relative_to(folder).as_posix().encode() + b"\0")
            total.update(re.sub(rb'"pace": [0-9.]+', b"", path.read_bytes()))
    return total.hexdigest()


def in_one_host(made: Experiment, host: str = "all") -> Experiment:
    """Return the same with one host for all agents: a process, or HERE for none."""
    for plan in made.plans.values():
        plan.host = host
    return made


def shared_memory(mark: str) -> set[str]:
    """What the processes with this mark have in shared memory: a kill leaves it."""
    found = set()
    for pid in relatives(mark):
        try:
            maps = Path(f"/proc/{pid}/maps").read_text(encoding="utf-8")
        except OSError:
            continue
        found |= {line for line in maps.splitlines() if "/dev/shm/" in line}
    return found


def free_port() -> int:
    """A port for a server that a test will start, a moment later.

    On Linux no other program is given it until this process ends: it stays bound at
    every address, and nobody listens there. A server that reuses addresses can have it
    all the same.
    """
    kept = sys.platform == "linux"
    with socket.socket() as probe:
        if kept:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("0.0.0.0" if kept else "127.0.0.1", 0))
        port = int(probe.getsockname()[1])
        if kept:
            probe.detach()
    return port


class Router:
    """A router in a process of its own. `with Router() as router:`."""

    def __init__(self, *more: str) -> None:
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self._more = more

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()

    def start(self) -> None:
        """Start it, at the port of one that was killed, too."""
        until(self._starts, KEPT if sys.platform == "win32" else 0.1)

    def _starts(self) -> bool:
        self._process = subprocess.Popen(
            [
                *(sys.executable, "-m", "rems_net.router"),
                *("--listen", self.endpoint, *self._more),
            ],
            stdout=subprocess.PIPE,
            encoding="utf-8",
        )
        assert self._process.stdout is not None
        if self._process.stdout.readline().startswith("Router at "):
            return True
        self.kill()
        return False

    @property
    def pid(self) -> int:
        return self._process.pid

    def kill(self) -> None:
        self._process.kill()
        self._process.communicate()


class Told(Show):
    """Keeps what a run says, and does something beside it."""

    def __init__(self, beside: Callable[[Clock], None] | None = None):
        self.events: list[Event] = []
        self.lines: list[str] = []
        self._beside = beside
        self._thread: threading.Thread | None = None
        self.errors: list[BaseException] = []

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        self.clock, self.endpoint = clock, endpoint
        if self._beside is not None:
            self._thread = threading.Thread(target=self._do, args=(clock,))
            self._thread.start()

    def _do(self, clock: Clock) -> None:
        assert self._beside is not None
        try:
            self._beside(clock)
        except BaseException as error:
            self.errors.append(error)

    def say(self, source: str, event: Event) -> None:
        self.events.append(event)
        self.lines.append(f"[{source}] {event}")

    def of(self, kind: str) -> list[str]:
        """The texts of the events of one kind."""
        return [event.text for event in self.events if event.kind == kind]

    @property
    def said(self) -> list[str]:
        """Without what a busy machine says by itself: held ticks, lost real time."""
        pairs = zip(self.lines, self.events, strict=True)
        return [line for line, event in pairs if event.kind not in ("held", "late")]

    def end(self) -> None:
        if self._thread is not None:
            self._thread.join()
        assert not self.errors, self.errors

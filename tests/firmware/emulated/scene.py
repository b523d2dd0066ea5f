"""A scene for emulated robots: a served fabric, drivers, what their servos did."""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Self

import pytest

from rems_net.errors import MissingPartError
from rems_net.firmware import build, port
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import free_port, until
from tests.commands import command
from tests.firmware.golden import schemas
from tests.signals import freeze, thaw

#: us from the middle in which a modelled servo stands
DEAD_BAND = 45
#: seconds between two commands of who drives
EVERY = 0.02
COMMAND = schemas()["command"]


def compiled() -> None:
    """Skip, in words, where the library cannot be had."""
    try:
        build.compiler()
    except MissingPartError as error:
        pytest.skip(str(error))
    build.library()


def ported() -> Path:
    """The posix port; skips, in words, where it cannot be had."""
    if (program := port.program()) is None:
        pytest.skip(
            "zenoh-pico is not installed where CMake looks (CMAKE_PREFIX_PATH says "
            "where), or there is no CMake."
        )
    return program


class Serve:
    """`rems router serve` in a process of its own, on one port, again and again.

    router: where it brings a clock alone.
    """

    def __init__(self, *more: str, router: str = "") -> None:
        self.port = free_port()
        self._more, self._router = more, router
        self._process: subprocess.Popen[str] | None = None

    @property
    def endpoint(self) -> str:
        return f"tcp/127.0.0.1:{self.port}"

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()

    def start(self) -> float:
        """Be there; the monotonic time [s] at which it is."""
        where = () if self._router else ("--listen", self.endpoint)
        words = ("router", "serve", *where, "--no-qr", *self._more)
        gone = os.environ.keys() - {"REMS_ROUTER"}
        told = {"REMS_ROUTER": self._router} if self._router else {}
        self._process = subprocess.Popen(
            command(*words),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={name: os.environ[name] for name in gone} | told,
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline().startswith("Open fabric")
        return time.monotonic()

    def kill(self) -> float:
        """Be gone at once; the monotonic time [s] at which it is."""
        assert self._process is not None
        self._process.kill()
        now = time.monotonic()
        self._process.communicate()
        return now

    def freeze(self) -> float:
        assert self._process is not None
        freeze(self._process.pid)
        return time.monotonic()

    def thaw(self) -> float:
        assert self._process is not None
        now = time.monotonic()
        thaw(self._process.pid)
        return now


class Driver:
    """Somebody who tells robots another speed all the time, and comes back by himself.

    Each command is another, so that each moves a servo: `said` has when it was put.
    """

    def __init__(
        self, endpoint: str, *robots: str, fabric: str = "rems", every: float = EVERY
    ):
        self._link = Link(endpoint, fabric=fabric)
        self._robots, self._every = robots, every
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run)
        #: monotonic time [s] and speed [rad/s] of each command
        self.said: list[tuple[float, float]] = []

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()

    def _run(self) -> None:
        session = Session(self._link)
        until(lambda: self._ending.is_set() or session.open_once())
        if self._ending.is_set():
            return
        schema = f"{COMMAND.name}@{COMMAND.digest}"
        with session:
            keys = [session.key("robot", name, "command") for name in self._robots]
            puts = [session.putting(key, schema) for key in keys]
            turn = 0
            while not self._ending.wait(self._every):
                turn += 1
                speed = 2.0 + 0.05 * (turn % 60)
                payload = COMMAND({"wheel": {"left": speed, "right": speed}}).encode()
                self.said.append((time.monotonic(), speed))
                for put in puts:
                    put(payload)


class Servos:
    """What its servos did: monotonic time [s], left, right [us] of each change."""

    def __init__(self, folder: Path, name: str):
        self._path = folder / f"{name}.servos"
        self._rows: list[tuple[float, int, int]] = []
        self._read = 0

    def rows(self) -> list[tuple[float, int, int]]:
        """All changes so far."""
        if self._path.exists():
            with self._path.open("rb") as file:
                file.seek(self._read)
                lines = file.read().rpartition(b"\n")[0]
            self._read += len(lines) + 1 if lines else 0
            for line in lines.splitlines():
                at, left, right = line.split()
                self._rows.append((float(at), int(left), int(right)))
        return self._rows

    @property
    def drives(self) -> bool:
        """Whether its pulses move it now."""
        rows = self.rows()
        return bool(rows) and rows[-1][1:] != (0, 0)

    def stood(self, since: float, until: float) -> float:
        """Seconds after `since` at which it stood for good until `until`."""
        before = [row for row in self.rows() if row[0] < until]
        assert before
        assert before[-1][1:] == (0, 0), "it drives"
        moving = [t for t, *pulses in before[:-1] if pulses != [0, 0]]
        stood = next(t for t, *pulses in before if pulses == [0, 0] and t >= moving[-1])
        return stood - since

    def drove(self, since: float) -> float:
        """Seconds after `since` at which it drove again."""
        again = [t for t, *pulses in self.rows() if t > since and pulses != [0, 0]]
        return again[0] - since if again else float("inf")


def pulse(speed: float) -> int:
    """The pulse of the left servo at a speed [rad/s], when it is calibrated [us]."""
    return round(1500 + DEAD_BAND + (500 - DEAD_BAND) * speed / 7.3)


if __name__ == "__main__":
    with Driver(sys.argv[1], *sys.argv[2:]):
        threading.Event().wait()

"""Program: a process of a rig, that can be frozen, thawed, killed and listened to."""

import os
import re
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from tests.agents.runs import LONGEST, calm

T = TypeVar("T")


def until(condition: Callable[[], T | None], what: str, seconds: float = 20.0) -> T:
    """What `condition` returns, once it is true; else an error that says `what`."""
    pause, begun, last = threading.Event(), calm(), time.monotonic() + LONGEST * seconds
    while calm() - begun < seconds and time.monotonic() < last:
        if found := condition():
            return found
        pause.wait(0.005)
    raise TimeoutError(f"{what} did not come within {seconds:g} s")


class Program:
    """A process whose lines go to a file, and whose standard input we hold."""

    def __init__(
        self, name: str, argv: Sequence[str], environment: Mapping[str, str], log: Path
    ):
        self.name, self.log = name, log
        with log.open("wb") as out:
            self.process = subprocess.Popen(
                argv,
                stdin=subprocess.PIPE,
                stdout=out,
                stderr=subprocess.STDOUT,
                env=dict(environment),
                cwd=log.parent,
            )

    @property
    def pid(self) -> int:
        return self.process.pid

    @property
    def ended(self) -> int | None:
        """Its exit status, once it has ended."""
        return self.process.poll()

    def text(self) -> str:
        """All that it has printed so far."""
        return self.log.read_text("utf-8", errors="replace")

    def wait_for(self, pattern: str, seconds: float = 20.0) -> re.Match[str]:
        """Wait until it has printed a line like this. Raises TimeoutError, with all."""

        def look() -> re.Match[str] | None:
            found = re.search(pattern, self.text(), re.MULTILINE)
            if found is None and self.ended is not None:
                raise RuntimeError(f"{self.name} has ended:\n{self.text()}")
            return found

        try:
            return until(look, f"{pattern!r} of {self.name}", seconds)
        except TimeoutError as error:
            raise TimeoutError(f"{error}; it said:\n{self.text()}") from None

    def tell(self, line: str) -> None:
        """Send a line to its standard input."""
        assert self.process.stdin is not None
        self.process.stdin.write(line.encode() + b"\n")
        self.process.stdin.flush()

    def ask(self, line: str, seconds: float = 20.0) -> str:
        """Send a line, and return the next whole line that it prints."""
        before = self.log.stat().st_size
        self.tell(line)

        def answered() -> str | None:
            said = self.log.read_bytes()[before:].decode(errors="replace")
            return said.partition("\n")[0] if "\n" in said else None

        return until(answered, f"the answer of {self.name} to {line!r}", seconds)

    def freeze(self) -> None:
        """Stop it, as a laptop that sleeps or a debugger does."""
        send(self.pid, signal.SIGSTOP)

    def thaw(self) -> None:
        send(self.pid, signal.SIGCONT)

    def kill(self) -> None:
        """End it without a word, and wait for its end."""
        send(self.pid, signal.SIGKILL)
        self.process.wait()

    def end(self) -> None:
        """Take leave of a process that has ended, or is about to."""
        self.process.wait()
        if self.process.stdin is not None:
            with suppress(BrokenPipeError):
                self.process.stdin.close()


def send(pid: int, sign: int) -> None:
    """Send a signal; a process that is gone needs none."""
    with suppress(ProcessLookupError):
        os.kill(pid, sign)

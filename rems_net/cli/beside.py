"""The page of a run or a router, in a process beside it.

A page in the run's own process would delay its ticks. The process ends with ours, since
we hold its standard input.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import nullcontext, suppress
from pathlib import Path
from threading import Thread
from typing import NamedTuple

from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.show import Show
from rems_net.events import Event
from rems_net.router.find import PASSWORD, USER
from rems_net.system.interrupts import HIDDEN, without_ctrl_c

#: s. The page gets this long to end by itself.
ENDING = 2.0


class ClassPages(NamedTuple):
    """Pages for the users of a class, each with the own rights.

    listen: the address for their browsers.
    sheet: file for their links.
    users: fabric and password by user.
    """

    listen: str
    sheet: Path
    users: dict[str, tuple[str, str]]


class Beside:
    """A process with the page of the fabric at an endpoint, for this machine.

    show: called with each line that it prints, in another thread.
    """

    def __init__(self, show: Callable[[str], None]):
        self._show = show
        self._process: subprocess.Popen[str] | None = None

    def start(
        self,
        endpoint: str,
        fabric: str,
        user: str = "",
        password: str = "",
        class_: ClassPages | None = None,
    ) -> None:
        """Start it. The password travels in its environment, which is private.

        user, password: of the session that its browsers share; "" at a router without
            users. It must not be the owner's: a page may do what its user may.
        class_: users with a page of their own; their passwords travel through a pipe.
        """
        known = {USER: user, PASSWORD: password} if user else {}
        words = ["dashboard", "--beside", "--no-qr", "--at", endpoint]
        words += ["--fabric", fabric]
        if class_ is not None:
            words += ["--listen", class_.listen, "--sheet", str(class_.sheet)]
        with without_ctrl_c():
            self._process = subprocess.Popen(
                [sys.executable, "-m", "rems_net", *words],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                encoding="utf-8",
                errors="replace",
                creationflags=HIDDEN,
                env={**os.environ, **known, "PYTHONIOENCODING": "utf-8"},
            )
        if class_ is not None and self._process.stdin is not None:
            with suppress(OSError):  # it has ended, and its last line has the reason
                self._process.stdin.write(json.dumps(class_.users) + "\n")
                self._process.stdin.flush()
        reading = Thread(target=self._read, args=(self._process,), daemon=True)
        reading.start()

    def _read(self, process: subprocess.Popen[str]) -> None:
        with process.stdout or nullcontext(()) as lines:
            for line in lines:
                self._show(line.rstrip())

    def end(self) -> None:
        """End it, and wait until it has ended."""
        process, self._process = self._process, None
        if process is not None and process.stdin is not None:
            process.stdin.close()
            try:
                process.wait(ENDING)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


class WithPage(Show):
    """Display of a run, with a page beside it."""

    def __init__(self, show: Show):
        self._show = show
        self._page = Beside(self._tell)

    def _tell(self, line: str) -> None:
        self._show.say("page", Event("info", 0, "page", "page", line))

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        """Start the display and the page."""
        self.clock = clock
        self._show.begin(clock, ticks, endpoint)
        self._page.start(endpoint, clock.session.fabric)

    def say(self, source: str, event: Event) -> None:
        """Show an event."""
        self._show.say(source, event)

    def end(self) -> None:
        """End both."""
        self._page.end()
        self._show.end()

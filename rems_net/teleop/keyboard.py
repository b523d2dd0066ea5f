"""Keyboard: the keys that a person holds down in this terminal."""

import sys
import time
from typing import Any, Self

from rems_net.errors import ExperimentError
from rems_net.teleop.deadman import Deadman
from rems_net.teleop.decoder import KeyEvent

#: s. In a terminal that reports no releases, a key's motion lasts for this long.
HOLD = 2.0
#: s. Keys are held down without a sign for this long; then we ask for one, so often. Of
#: several keys only the newest one repeats.
ASK = 0.25


class Keyboard:
    """The keys of one terminal; `with open_keyboard() as keyboard:` restores it.

    console: reads key events, one kind for each system.
    """

    def __init__(self, console: Any):
        self._console = console
        #: whether the terminal reports that a key was released
        self.releases: bool = console.releases
        #: keys that were pressed since the last call of `wait`
        self.pressed: list[str] = []
        self._down: set[str] = set()
        self._until = self._asked = 0.0
        self._deadman = Deadman()
        self._deadman.sign(deflected=False)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._console.close()

    @property
    def held(self) -> set[str]:
        """Names of the keys that are held down, or that still count."""
        return self._down if self._deadman.drives else set()

    @property
    def silent(self) -> bool:
        """Whether held keys do not count, since there was no sign for SILENT s."""
        return self._deadman.silent

    def wait(self, seconds: float) -> None:
        """Take in what is typed in this time. Raises KeyboardInterrupt at Ctrl+C."""
        self.pressed.clear()
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            for event in self._console.read(left):
                self._take(event)
        if not self.releases:
            if time.monotonic() > self._until:
                self._down.clear()
            self._deadman.sign(deflected=False)  # the key's motion ends by itself
        elif self._deadman.silence > ASK and time.monotonic() > self._asked + ASK:
            self._asked = time.monotonic()
            if self._console.ask(self._down):
                self._deadman.sign(deflected=True)

    def _take(self, event: KeyEvent) -> None:
        if not event.pressed:
            self._down -= {event.key} if event.key else self._down
        elif event.key and not event.repeated:
            self.pressed.append(event.key)
            if not self.releases:  # the newest key alone counts, for some time
                self._down.clear()
                self._until = time.monotonic() + HOLD
            self._down.add(event.key)
        self._deadman.sign(deflected=bool(self._down))


def open_keyboard() -> Keyboard:
    """Return the keys of the terminal. Raises ExperimentError without a terminal."""
    if not sys.stdin.isatty():
        raise ExperimentError(
            "rems drive reads the keys of a terminal, and its input is a pipe or a "
            "file. Type it in a terminal, or type: rems put robot/sim/command "
            'wheel/left="50 %" --for "2 s" (R0913)'
        )
    if sys.platform == "win32":
        from rems_net.teleop.windows import WindowsConsole

        return Keyboard(WindowsConsole())
    from rems_net.teleop.posix import PosixConsole

    return Keyboard(PosixConsole())

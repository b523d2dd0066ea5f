"""PosixConsole: key events of a terminal on Linux or macOS."""

import os
import select
import sys
import time
from collections.abc import Set
from contextlib import suppress

from rems_net.teleop.decoder import (
    BEGIN,
    END,
    KIND,
    QUESTION,
    Decoder,
    KeyEvent,
    has_answered,
    knows_releases,
)

if sys.platform != "win32":
    import termios
    import tty

#: s. A terminal answers at once; one over a slow line gets this long.
ANSWER = 0.5


class PosixConsole:
    """The terminal of this process, without echo, and restored by `close`."""

    def __init__(self) -> None:
        assert sys.platform != "win32"
        self._in, self._out = sys.stdin.fileno(), sys.stdout.fileno()
        self._before = termios.tcgetattr(self._in)
        self._decoder = Decoder()
        self.releases = False
        try:
            tty.setcbreak(self._in)
            self.releases = self._ask()
            if self.releases:
                os.write(self._out, BEGIN)
        except BaseException:
            self.close()
            raise

    def _ask(self) -> bool:
        """Return whether the terminal reports releases."""
        os.write(self._out, QUESTION)
        answer, until = b"", time.monotonic() + ANSWER
        while not has_answered(answer) and (left := until - time.monotonic()) > 0:
            answer += self._bytes(left)
        return knows_releases(answer)

    def _bytes(self, seconds: float) -> bytes:
        ready, _, _ = select.select([self._in], [], [], seconds)
        if not ready:
            return b""
        found = os.read(self._in, 4096)
        if not found:  # the window was closed
            raise KeyboardInterrupt
        return found

    def read(self, seconds: float) -> list[KeyEvent]:
        """Return the events that came in this time, at the first that do."""
        return self._decoder.feed(self._bytes(seconds))

    def ask(self, keys: Set[str]) -> bool:
        """Ask the terminal for a sign, which `read` returns; return False."""
        os.write(self._out, KIND)
        return False

    def close(self) -> None:
        """Restore the terminal."""
        assert sys.platform != "win32"
        with suppress(OSError, termios.error):  # the window may be closed
            if self.releases:
                os.write(self._out, END)
            termios.tcsetattr(self._in, termios.TCSADRAIN, self._before)

"""A Windows console in a terminal of Linux: keys are typed, and its text is read.

Wine's console host draws into a pseudo-terminal, as it does for a user of Linux.
"""

import fcntl
import os
import re
import select
import struct
import subprocess
import termios
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from tests.windows.wine import Windows

#: what moves the cursor, sets colours or the title
ESCAPES = re.compile(r"\x1b(\[[0-9;?]*[A-Za-z]|\][^\x07]*\x07|[()][A-Z0-9]|[=>78])")
#: s. Between two looks whether a program has ended
LOOK = 0.1
#: lines and columns
SIZE = (40, 200)


class Console:
    """The console of one program of Windows, and the program."""

    def __init__(self, process: subprocess.Popen[bytes], terminal: int):
        self.process, self._terminal = process, terminal
        #: all that was drawn, without escapes
        self.text = ""

    def type(self, keys: str) -> None:
        """Type these keys; "\\x03" is Ctrl+C, "\\r" is Enter."""
        os.write(self._terminal, keys.encode())

    def wait_for(self, pattern: str, seconds: float = 60.0) -> str:
        """Wait until the text has this; return all text, and begin anew behind it."""
        until = time.monotonic() + seconds
        while not (found := re.search(pattern, self.text)):
            left = until - time.monotonic()
            assert left > 0, f"{pattern!r} does not come: {self.text[-2000:]}"
            self._read(left)
        before, self.text = self.text, self.text[found.end() :]
        return before

    def wait(self, seconds: float) -> None:
        """Take in what is drawn in this time."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            self._read(left)

    def status(self, seconds: float = 30.0) -> int:
        """Wait for the program's end; return its exit status."""
        until = time.monotonic() + seconds
        while (status := self.process.poll()) is None:
            assert time.monotonic() < until, f"it goes on: {self.text[-2000:]}"
            self._read(0.1)
        return status

    def _read(self, seconds: float) -> None:
        """Take in what is drawn in this time."""
        if select.select([self._terminal], [], [], seconds)[0]:
            try:
                data = os.read(self._terminal, 65536).decode(errors="replace")
            except OSError:  # the console host has gone
                time.sleep(LOOK)
                return
            self.text += ESCAPES.sub("", data)

    def close(self) -> None:
        """Close the window."""
        if self._terminal >= 0:
            os.close(self._terminal)
            self._terminal = -1


@contextmanager
def console(
    windows: Windows,
    folder: Path,
    *words: str | Path,
    enter: Sequence[str] = (),
    **more: str,
) -> Iterator[Console]:
    """Run a program of Windows in a console of its own; end it after the block.

    enter: the words that start it on another machine; more: variables.
    """
    ours, theirs = os.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", *SIZE, 0, 0))
    modes = termios.tcgetattr(theirs)
    modes[0] &= ~termios.ICRNL  # else Enter becomes Ctrl+J
    termios.tcsetattr(theirs, termios.TCSANOW, modes)
    process = subprocess.Popen(
        [*enter, "setsid", "--ctty", "wine", *map(str, words)],
        cwd=folder,
        env=windows.environment | {"TERM": "xterm"} | more,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
    )
    os.close(theirs)
    shown = Console(process, ours)
    try:
        yield shown
    finally:
        process.kill()
        process.wait()
        shown.close()

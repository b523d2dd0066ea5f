"""A Woodbot's console, compiled here, at a pseudo-terminal as at a USB cable."""

import os
import subprocess
import time
from pathlib import Path

import pytest

from tests.firmware.compiling import FIRMWARE
from tests.firmware.program import compiled

#: seconds that anything may take on a machine that is busy
TIMEOUT = 30.0


#: of the core
CONSOLE = ("settings/*", "console/*")


def build(folder: Path, test: str, core: tuple[str, ...], *others: str) -> Path:
    """`test/<test>.c` with files of the core, and sanitizers where they work."""
    found = [path for name in core for path in (FIRMWARE / "core").glob(f"{name}.c")]
    names = (str(path.relative_to(FIRMWARE)) for path in sorted(found))
    sources = (*names, *others, f"test/{test}.c")
    return compiled(FIRMWARE, folder, sources)


class Robot:
    """The program at one end of a pseudo-terminal; `port` is the other's name."""

    def __init__(self, program: Path, settings: Path):
        pty = pytest.importorskip("pty", reason="There are no pseudo-terminals here.")
        import tty

        self.master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self.settings = settings
        self._process = subprocess.Popen(
            [program, settings],
            stdin=self.master,
            stdout=self.master,
            stderr=subprocess.PIPE,
        )

    def write(self, portion: bytes) -> None:
        """Say something on the cable, by hand."""
        os.write(self._slave, portion)

    def read(self) -> bytes:
        """Return what has come on the cable, without waiting."""
        os.set_blocking(self._slave, False)
        try:
            return os.read(self._slave, 4096)
        except BlockingIOError:
            return b""

    def read_until(self, end: bytes, seconds: float = TIMEOUT) -> bytes:
        """All that comes, until `end` does."""
        got, until = b"", time.monotonic() + seconds
        while end not in got:
            assert time.monotonic() < until, got
            portion = self.read()
            got += portion
            if not portion:
                time.sleep(0.005)
        return got

    def close(self) -> None:
        """Pull the cable out: the program ends, and has nothing to complain of."""
        os.close(self.master)
        os.close(self._slave)
        try:
            _, complaints = self._process.communicate(timeout=TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise
        assert (self._process.returncode, complaints) == (0, b"")

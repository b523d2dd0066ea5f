"""A Woodbot's console, compiled here, at a pseudo-terminal as at a USB cable."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from tests.firmware.test_codec import SANITIZE, works

FIRMWARE = Path(__file__).parents[3] / "firmware" / "esp32_woodbot"
FLAGS = ["-std=c11", "-O1", "-g", "-Wall", "-Wextra", "-Werror", "-Wconversion"]
CONSOLE = (
    "settings",
    "decimal",
    "utf8",
    "crc32",
    "improv",
    "console",
    "console_improv",
)
#: seconds that anything may take on a machine that is busy
PATIENCE = 30.0


def compiled(
    folder: Path, test: str, *core: str, others: tuple[Path, ...] = ()
) -> Path:
    """`test/<test>.c` with files of the core, and sanitizers where they work."""
    compiler = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    if compiler is None:
        pytest.skip("There is no C compiler here: cc, gcc and clang are not found.")
    sources = [FIRMWARE / "test" / f"{test}.c", *others]
    sources += [FIRMWARE / "core" / f"{name}.c" for name in core]
    sanitize = SANITIZE if works([compiler, *SANITIZE], folder) else []
    done = subprocess.run(
        [compiler, *FLAGS, *sanitize, *map(str, sources), "-o", str(folder / test)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder / test


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

    def read_until(self, end: bytes, seconds: float = PATIENCE) -> bytes:
        """All that comes, until `end` does."""
        os.set_blocking(self._slave, False)
        got, until = b"", time.monotonic() + seconds
        while end not in got:
            assert time.monotonic() < until, got
            try:
                got += os.read(self._slave, 4096)
            except BlockingIOError:
                time.sleep(0.005)
        return got

    def close(self) -> None:
        """Pull the cable out: the program ends, and has nothing to complain of."""
        os.close(self.master)
        os.close(self._slave)
        try:
            _, complaints = self._process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise
        assert (self._process.returncode, complaints) == (0, b"")

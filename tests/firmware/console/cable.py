"""A cable with a session at its robot's end, and a bad one in between."""

import os
import random
import select
import subprocess
import threading
from pathlib import Path

import pytest

from rems_net.cable.bridge import Bridge
from rems_net.cable.port import open_port
from tests.firmware.console.robot import TIMEOUT


class BadCable:
    """Carries bytes from one pseudo-terminal to another, and damages some.

    loss: of a byte, to be lost; and as likely to be another.
    """

    def __init__(self, ends: tuple[int, int], loss: float):
        self._ends, self._loss = ends, loss
        self._random = random.Random(7)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._carry)
        self._thread.start()

    def _carry(self) -> None:
        other = dict(zip(self._ends, reversed(self._ends), strict=True))
        while not self._over.is_set():
            for end in select.select(self._ends, [], [], 0.05)[0]:
                portion = bytearray(os.read(end, 4096))
                for i in reversed(range(len(portion))):
                    if self._random.random() < self._loss:
                        del portion[i]
                    elif self._random.random() < self._loss:
                        portion[i] ^= 1 << self._random.randrange(8)
                os.write(other[end], portion)

    def close(self) -> None:
        self._over.set()
        self._thread.join()


class Cabled:
    """`test_cable` at one end; a Bridge, in a thread, at the other."""

    def __init__(self, program: Path, router: tuple[str, int], loss: float = 0.0):
        pty = pytest.importorskip("pty", reason="There are no pseudo-terminals here.")
        import tty

        self._fds = [*pty.openpty(), *pty.openpty()]
        robot, middle, other, here = self._fds
        tty.setraw(middle)
        tty.setraw(here)
        self._process = subprocess.Popen(
            [program], stdin=robot, stdout=robot, stderr=subprocess.PIPE, text=True
        )
        assert self._process.stderr is not None
        #: where a session connects to, as to a router
        self.locator = self._process.stderr.readline().strip()
        self._cable = BadCable((middle, other), loss)
        self.told: list[str] = []
        self.port = os.ttyname(here)
        self._line = open_port(self.port)
        self._bridge = Bridge(self._line, router, self.told.append)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        try:
            self._bridge.run()
        except OSError as error:
            self.told.append(f"broken: {error}")

    def say(self, text: str) -> None:
        """A line for the robot's console, which echoes."""
        self._line.write(f"{text}\n".encode())

    def close(self) -> None:
        """Pull it out."""
        self._cable.close()
        for fd in self._fds:
            os.close(fd)
        self._thread.join(TIMEOUT)
        assert not self._thread.is_alive()
        self._line.close()
        _, complaints = self._process.communicate(timeout=TIMEOUT)
        assert (self._process.returncode, complaints) == (0, "")
        assert self.told[-1].startswith("broken: ")

"""`rems drive` in a real terminal: a pseudo-terminal that is kitty, or is not."""

import os
import select
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from rems_net.client import Fabric
from rems_net.client.proxy import Proxy
from tests.agents.runs import until
from tests.cli.complaint import complaint
from tests.cli.conftest import text
from tests.commands import Running, Start, begun, command

if sys.platform == "win32":
    pytest.skip("Windows has no pseudo-terminals", allow_module_level=True)
else:
    import pty
    import termios


KITTY, PLAIN = b"\x1b[?0u\x1b[?62c", b"\x1b[?62c"
UP, REPEATED, RELEASED = b"\x1b[1;1:1A", b"\x1b[1;1:2A", b"\x1b[1;1:3A"


class Window:
    """A terminal window with `rems drive` in it."""

    def __init__(self, answer: bytes, *words: str):
        self.master, self.slave = pty.openpty()
        self.before = termios.tcgetattr(self.slave)
        self.answer, self.out = answer, b""
        self.process = begun(command("drive", *words), screen=self.slave)

    def type(self, keys: bytes) -> None:
        os.write(self.master, keys)

    def read(self, seconds: float = 0.05) -> str:
        """Return all that it showed; answer its question as a terminal does."""
        if select.select([self.master], [], [], seconds)[0]:
            piece = os.read(self.master, 4096)
            if b"\x1b[c" in piece:
                os.write(self.master, self.answer)
            self.out += piece
        return self.out.decode(errors="replace")

    def shows(self, words: str) -> None:
        until(lambda: words in self.read())

    def stands(self, robot: Proxy) -> None:
        """Wait until the robot stands: two states alike."""

        def alike() -> bool:
            self.read()
            first, last = list(robot.watch("state", 2))
            return bool(first == last)

        until(alike)

    def end(self) -> int:
        until(lambda: self.read() and self.process.poll() is not None)
        return self.process.wait()

    @property
    def restored(self) -> bool:
        return termios.tcgetattr(self.slave) == self.before


@contextmanager
def window(answer: bytes, *words: str) -> Iterator[Window]:
    made = Window(answer, *words)
    try:
        yield made
    finally:
        if made.process.poll() is None:
            made.process.kill()
        made.process.wait()
        for end in (made.master, made.slave):
            try:
                os.close(end)
            except OSError:  # the test has closed it
                continue


def test_keys_that_are_held_and_released(still: Fabric) -> None:
    proxy = still.robot("alice")
    before = proxy.state.x
    with window(KITTY, "robot/alice") as opened:
        opened.shows("Ctrl+C ends it.")
        assert not opened.restored  # keys are not echoed
        opened.type(UP)
        until(lambda: opened.read() and proxy.state.x > before + 0.01)
        opened.type(RELEASED)
        opened.stands(proxy)
        opened.type(b"x")
        opened.shows("'x' moves nothing; keys are up, down")
        opened.type(b"\x1b[99;5u")  # Ctrl+C, as kitty sends it
        assert opened.end() == 130
        assert opened.restored
        assert opened.out.endswith(b"\x1b[?1004l\x1b[<u")


def test_a_line_that_freezes_with_a_key_down(still: Fabric) -> None:
    """A terminal that answers holds its key; one that does not has let it go."""
    proxy = still.robot("alice")
    with window(KITTY, "robot/alice") as opened:
        opened.shows("Ctrl+C ends it.")
        opened.type(UP)
        asked = len(opened.out) + 1
        until(lambda: opened.read() and opened.out.count(b"\x1b[c", asked) > 8)
        before = proxy.state.x
        until(lambda: opened.read() and proxy.state.x > before + 0.01)
        opened.answer = b""
        opened.stands(proxy)
        opened.shows("gave no sign for 1 s while a key was held down")
        opened.answer = KITTY
        opened.type(REPEATED)  # the line is back, and the key still down
        opened.stands(proxy)
        before = proxy.state.x
        opened.type(RELEASED + UP)
        until(lambda: opened.read() and proxy.state.x > before + 0.01)
        opened.type(RELEASED)


def test_a_key_that_was_down_before(still: Fabric) -> None:
    proxy = still.robot("alice")
    before = proxy.state.x
    with window(KITTY, "robot/alice") as opened:
        opened.shows("Ctrl+C ends it.")
        for _ in range(5):
            opened.type(REPEATED)
            opened.stands(proxy)
        assert proxy.state.x == before


def test_a_terminal_without_releases(still: Fabric) -> None:
    """Each key moves for 2 s; a closed window ends it, and the robot stands."""
    proxy = still.robot("alice")
    before = proxy.state.x
    with window(PLAIN, "robot/a*") as opened:
        opened.shows("does not report when a key is released")
        pressed = time.monotonic()
        opened.type(b"w")
        until(lambda: opened.read() and proxy.state.x > before + 0.01)
        opened.stands(proxy)
        assert time.monotonic() - pressed > 1.9
        opened.type(b"w")
        os.close(opened.slave)
        os.close(opened.master)
        assert opened.process.wait(20) in (1, 130, -signal.SIGHUP)
    until(lambda: next(proxy.watch("state", 1)) == next(proxy.watch("state", 1)))


def test_it_is_ended_by_a_signal(here: Fabric, alice: Running) -> None:
    with window(KITTY, "robot/alice") as opened:
        opened.shows("Ctrl+C ends it.")
        opened.process.send_signal(signal.SIGTERM)
        assert opened.end() == 130
        assert opened.restored
    with window(KITTY, "robot/alice") as opened:
        opened.shows("Ctrl+C ends it.")
        here.stop()
        opened.type(UP)
        opened.shows("robot/alice is stopped: it stands still")
        text(alice)
        opened.shows("robot/alice has left")
        assert opened.end() == 0
        assert opened.restored


def test_no_terminal(still: Fabric, start: Start) -> None:
    before = still.robot("alice").state.x
    piped = start("drive", "robot/alice", typed=True)
    _, said = piped.communicate("", timeout=20)
    assert piped.returncode == 2
    assert said.startswith("rems: rems drive reads the keys of a terminal, and ")
    assert still.robot("alice").state.x == before


def test_a_misspelt_robot(still: Fabric, capsys: pytest.CaptureFixture[str]) -> None:
    assert complaint(capsys, "drive", "robot/alise") == (
        "There is no robot/alise. Did you mean 'robot/alice'? Robots and inputs "
        "here: robot/alice. Type: rems list"
    )
    assert complaint(capsys, "drive", "robot/b*") == (
        "No robot matches 'robot/b*'. Type: rems list"
    )

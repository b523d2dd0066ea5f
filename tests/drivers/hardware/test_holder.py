"""The process that holds a port: what it writes there, whatever happens to its host."""

import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.agents.wall import wall
from rems_net.drivers.hardware import held
from rems_net.drivers.hardware.frames import STAMP, Kind
from rems_net.drivers.hardware.serial import HeldSerial
from rems_net.emulators.terminal import Terminal
from tests.agents.runs import alive, until
from tests.signals import KILL, freeze, thaw

pytest.importorskip("pty", reason="there are no pseudo-terminals here")
pytest.importorskip("serial", reason="pyserial is not installed")

MAX_AGE, BUSY = 0.2, 0.5
HALT, FAREWELL, AHEAD = b"<halt>", b"<bye>", b"<ahead>"


class Bench:
    """A held port, and the far end of its line."""

    def __init__(self, folder: Path):
        self.line = Terminal(folder / "port")
        self.port = HeldSerial(timeout=0.2, write_timeout=0.5)
        self.port.reach(str(folder / "port"), 115_200)
        self.port.arm(MAX_AGE, HALT, FAREWELL)
        self.came = b""

    @property
    def pid(self) -> int:
        assert self.port._process is not None
        return self.port._process.pid

    def saw(self, what: bytes, seconds: float = 5.0) -> float:
        """Wait until this came; when that was (monotonic, s). What came is kept."""
        until = time.monotonic() + seconds
        while what not in self.came:
            assert time.monotonic() < until, self.came
            self.came += self.line.receive(0.01)
        return time.monotonic()


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    bench = Bench(tmp_path)
    yield bench
    bench.port.end()
    bench.line.close()


def test_bytes_go_both_ways(bench: Bench) -> None:
    bench.port.write(AHEAD)
    bench.saw(AHEAD)
    bench.line.send(b"one line\nand more")
    assert bench.port.read_until(b"\n") == b"one line\n"
    assert bench.port.read(8) == b"and more"
    assert bench.port.read(1) == b""  # after its timeout
    assert bench.port.in_waiting == 0


def test_a_silent_host(bench: Bench) -> None:
    """It halts again and again, and lets through what the host writes after that."""
    bench.port.write(AHEAD)
    begun = bench.saw(AHEAD)
    bench.came = b""
    took = bench.saw(HALT) - begun
    assert MAX_AGE - 0.05 < took < MAX_AGE + BUSY
    bench.saw(HALT + HALT)
    bench.came = b""
    bench.port.write(AHEAD)
    bench.saw(AHEAD)


def test_after_a_sleep_it_halts_first(bench: Bench) -> None:
    """What waited meanwhile is of the past; so it is after a laptop's sleep."""
    bench.port.write(AHEAD)
    bench.saw(AHEAD)
    bench.came = b""
    freeze(bench.pid)
    begun = wall()
    bench.port.write(b"<old>")
    until(lambda: wall() > begun + 2 * MAX_AGE)
    # by its host, which slept, too, and would otherwise end a holder that is silent
    bench.port._send(Kind.WRITE, STAMP.pack(wall()) + b"<new>")
    thaw(bench.pid)
    bench.saw(b"<new>")
    assert bench.came.startswith(HALT)
    assert b"<old>" not in bench.came


def test_the_end_of_its_host_ends_it(bench: Bench) -> None:
    """It halts, says what is to be said, and gives the port back."""
    bench.port.write(AHEAD)
    pid, begun = bench.pid, time.monotonic()
    bench.port.end()
    assert time.monotonic() - begun < 1.0 + BUSY
    bench.saw(FAREWELL)
    assert bench.came.startswith(AHEAD + HALT)
    assert not alive(pid)
    bench.port.reach(bench.line.where, 115_200)  # by a process of its own, at once
    assert bench.pid != pid


def test_a_port_that_is_closed_is_left_in_peace(bench: Bench) -> None:
    """The driver has stopped its robot by then. The process is kept for the next."""
    pid = bench.pid
    bench.port.write(AHEAD)
    bench.saw(AHEAD)
    bench.came = b""
    bench.port.close()
    bench.port.reach(bench.line.where, 115_200)
    bench.port.write(b"<next>")
    bench.saw(b"<next>")
    assert bench.came == b"<next>"
    assert bench.pid == pid


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
def test_signals_of_a_shutdown_do_not_end_it(bench: Bench) -> None:
    for sign in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        os.kill(bench.pid, sign)
    bench.port.write(AHEAD)
    bench.saw(AHEAD)
    assert os.getsid(bench.pid) == bench.pid  # no terminal's


def test_its_own_death_breaks_the_line(bench: Bench) -> None:
    """The driver connects anew then, and so starts another one."""
    pid = bench.pid
    os.kill(pid, KILL)
    with pytest.raises(OSError, match="the process that holds the port has ended"):
        until(lambda: bench.port.read() and False)
    bench.port.reach(bench.line.where, 115_200)
    assert bench.pid != pid


@pytest.mark.parametrize("how", ["killed", "frozen"])
def test_its_host_halts_the_robot_without_it(bench: Bench, how: str) -> None:
    """Its host opens the port itself, and then starts another such process."""
    pid = bench.pid
    bench.port.write(AHEAD)
    bench.saw(AHEAD)
    assert bench.port.in_waiting == 0  # it has confirmed that
    bench.came = b""
    freeze(pid) if how == "frozen" else os.kill(pid, KILL)
    why = "did not answer for 0.2 s" if how == "frozen" else "has ended"
    with pytest.raises(OSError, match=f"the process that holds the port {why}"):
        until(lambda: bench.port.write(b"<on>") and bench.port.read() and False)
    bench.saw(HALT)
    assert bench.came.endswith(HALT)
    assert not alive(pid)
    bench.port.reach(bench.line.where, 115_200)
    assert bench.pid != pid


def test_a_write_that_hangs(bench: Bench) -> None:
    """The line takes nothing more; a new process begins with an empty one."""
    pid = bench.pid
    bench.port.write(bytes(1 << 20))
    with pytest.raises(OSError, match=r"did not answer for 0\.2 s"):
        until(lambda: bench.port.read() and False)
    assert not alive(pid)
    bench.saw(HALT)


def test_a_line_that_breaks(bench: Bench) -> None:
    bench.line.unplug()
    with pytest.raises(OSError, match=r"Input/output error|no data"):
        until(lambda: bench.port.read() and False)
    with pytest.raises(FileNotFoundError):
        bench.port.reach(bench.line.where, 115_200)
    bench.line.plug()
    bench.port.reach(bench.line.where, 115_200)


INTRUDER = """\
import socket, sys
from rems_net.drivers.hardware import holder
from rems_net.drivers.hardware.frames import Frames, Kind
other = Frames(socket.create_connection(("127.0.0.1", int(sys.argv[1]))))
other.send(Kind.TOKEN, bytes(16))
holder.main()
"""


def test_it_is_known_by_its_token(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another program at the loopback port is not taken for it."""
    monkeypatch.setattr(held, "HOLDER", (sys.executable, "-c", INTRUDER))
    bench = Bench(tmp_path)
    bench.port.write(AHEAD)
    bench.saw(AHEAD)
    bench.port.end()
    bench.line.close()


def test_one_that_does_not_start(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(held, "HOLDER", (sys.executable, "-c", "raise SystemExit(3)"))
    port = HeldSerial(timeout=0.2, write_timeout=0.5)
    with pytest.raises(OSError, match="did not start"):
        port.start()
    assert port._process is None

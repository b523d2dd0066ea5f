"""The line of an emulator, what goes wrong on it, and what a port makes of that."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from rems_net.emulators.create2.device import Create2Device
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.faults import Faults
from rems_net.emulators.terminal import Terminal
from rems_net.errors import ExperimentError, FabricError
from tests.agents.runs import until

serial = pytest.importorskip("serial", reason="pyserial is not installed")
pytest.importorskip("pty", reason="there are no pseudo-terminals here")

PACKET = st.binary(min_size=1, max_size=50)


@settings(max_examples=100)
@given(PACKET, st.integers(0, 100))
def test_each_fault_does_what_it_says(packet: bytes, seed: int) -> None:
    assert Faults(seed=seed).damage(packet) == packet
    assert Faults(lose=1, seed=seed).damage(packet) == b""
    dropped = Faults(drop=1, seed=seed).damage(packet)
    assert len(dropped) == len(packet) - 1
    wrong = Faults(corrupt=1, seed=seed).damage(packet)
    assert len(wrong) == len(packet)
    other = [a ^ b for a, b in zip(wrong, packet, strict=True) if a != b]
    assert [bin(one).count("1") for one in other] == [1]


def test_as_often_as_it_says() -> None:
    faults = Faults(corrupt=0.05)
    for _ in range(10_000):
        faults.damage(b"packet")
    assert 400 < faults.done < 600
    faults.clear()
    assert faults.damage(b"packet") == b"packet"


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    made = Terminal(tmp_path / "port")
    yield made
    made.close()
    assert not (tmp_path / "port").exists()


def test_a_real_port_opens_it(terminal: Terminal) -> None:
    with serial.Serial(terminal.where, 57_600, timeout=5) as port:
        port.write(b"ahead")
        assert terminal.receive(5) == b"ahead"
        terminal.send(b"\x00\n\r\xff")  # nothing of it is translated
        assert port.read(4) == b"\x00\n\r\xff"
        assert terminal.baud == 57_600
    assert terminal.receive(0) == b""


def test_unplugged_and_back(terminal: Terminal) -> None:
    with serial.Serial(terminal.where, timeout=5) as port:
        terminal.unplug()
        with pytest.raises(serial.SerialException):
            port.read(1)
    assert terminal.baud is None
    with pytest.raises(serial.SerialException):
        serial.Serial(terminal.where)
    terminal.plug()
    with serial.Serial(terminal.where, timeout=5) as port:
        port.write(b"again")
        assert terminal.receive(5) == b"again"


def test_what_nobody_reads_is_lost(terminal: Terminal) -> None:
    for _ in range(1000):
        terminal.send(bytes(100))
    with serial.Serial(terminal.where, timeout=5) as port:
        until(lambda: not port.read(port.in_waiting))
        terminal.send(b"now")
        assert port.read(3) == b"now"


def test_it_takes_nobodys_place(terminal: Terminal, tmp_path: Path) -> None:
    with pytest.raises(FabricError, match=r"something at .*port already.*--port"):
        Terminal(terminal.path)
    file = tmp_path / "essay.txt"
    file.write_text("all of it")
    with pytest.raises(FabricError, match=r"something at .*essay\.txt"):
        Terminal(file)
    assert file.read_text() == "all of it"
    for nowhere in (tmp_path / "none" / "port", file / "port"):
        with pytest.raises(FabricError, match=r"^no port can be put at .*: No.*--port"):
            Terminal(nowhere)
    left = tmp_path / "of a killed one"
    left.symlink_to(tmp_path / "gone")
    Terminal(left).close()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("", "'' is nothing that can happen to it; expected one of lose, drop"),
        ("corupt 0.1", "Did you mean 'corrupt'?"),
        ("corrupt", "expected: corrupt SHARE"),
        ("corrupt 5", "corrupt is '5'; expected a number, 0 to 1."),
        ("corrupt nan", "corrupt is 'nan'"),
        ("unplug ever", "unplug is 'ever'; expected a number, 0 to 3600."),
        ("reset 5", "expected: reset"),
        ("bump behind", "expected: bump left, bump right, bump both, bump none."),
        ("lift it", "expected: lift."),
    ],
)
def test_words_that_mean_nothing(words: str, says: str, tmp_path: Path) -> None:
    with (
        Emulator(Create2Device(), Terminal(tmp_path / "port")) as emulator,
        pytest.raises(ExperimentError) as caught,
    ):
        emulator.order(words)
    assert says in str(caught.value)


def test_words_that_mean_something(tmp_path: Path) -> None:
    with Emulator(Create2Device(), Terminal(tmp_path / "port")) as emulator:
        emulator.order("corrupt 0.25")
        emulator.order("drop 0.5 heard")
        emulator.order("late 0.1")
        emulator.order("echo")
        emulator.order("lift")
        until(lambda: emulator.device.body.lifted)
        assert emulator.said.corrupt == 0.25
        assert (emulator.said.late, emulator.heard.late) == (0.1, 0)
        assert (emulator.said.drop, emulator.heard.drop) == (0, 0.5)
        assert emulator.echo
        emulator.order("fine")
        until(lambda: not emulator.echo)
        assert emulator.said.corrupt == emulator.heard.drop == 0


def test_what_a_line_is_slow_and_late_for(tmp_path: Path) -> None:
    """Bytes take their time, and come late, but in order."""
    with Emulator(Create2Device(boot=0.0), Terminal(tmp_path / "port")) as emulator:
        emulator.order("late 0.2")
        until(lambda: emulator.said.late)
        with serial.Serial(emulator.where, 115_200, timeout=5) as port:
            begun = time.monotonic()
            port.write(bytes([128, 131, 142, 35, 142, 100]))
            assert port.read(1) in (b"\x00", b"\x02")
            assert time.monotonic() - begun > 0.2
            assert len(port.read(80)) == 80

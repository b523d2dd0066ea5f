"""`rems board emulate create2` and `rems board ports`, as they are typed."""

import json
import subprocess
from pathlib import Path
from typing import IO

import pytest

from rems_net.emulators.terminal import Terminal
from tests.agents.runs import until
from tests.commands import Run, begun, command
from tests.drivers.hardware.create2.scene import emulated, opened


def test_what_answers(rems: Run, tmp_path: Path) -> None:
    with emulated(tmp_path) as emulator:
        done = rems("board", "ports", emulator.where, str(tmp_path / "none"), "--json")
        assert (done.returncode, done.stderr) == (0, "")
        there, none = json.loads(done.stdout)
        assert there["answer"] == "Create 2 (off, battery 16.4 V, 100%)"
        assert none["answer"].startswith(f"there is no port {tmp_path / 'none'}.")
        assert emulator.device.interface.mode == 0
        with opened(emulator):
            done = rems("board", "ports", emulator.where)
            assert "another program uses" in done.stdout


def test_one_that_was_set_to_another_speed(rems: Run, tmp_path: Path) -> None:
    with emulated(tmp_path) as emulator:
        emulator.device.interface.baud = 19_200
        done = rems("board", "ports", emulator.where)
        assert "options baud = 19200" in " ".join(done.stdout.split())


def test_nobody_answers(rems: Run, tmp_path: Path) -> None:
    pytest.importorskip("serial", reason="pyserial is not installed")
    pytest.importorskip("pty", reason="there are no pseudo-terminals here")
    terminal = Terminal(tmp_path / "port")
    try:
        done = rems("board", "ports", terminal.where)
    finally:
        terminal.close()
    assert "nothing that rems knows" in " ".join(done.stdout.split())


def test_which_there_are(program: Run) -> None:
    pytest.importorskip("serial", reason="pyserial is not installed")
    done = program("board", "ports", "--quiet")
    if done.returncode == 0:
        assert "the system's name" in done.stdout
    else:
        assert "There is no serial port here." in done.stderr


def test_a_device_in_a_terminal(rems: Run, tmp_path: Path) -> None:
    pytest.importorskip("serial", reason="pyserial is not installed")
    pytest.importorskip("pty", reason="there are no pseudo-terminals here")
    port = tmp_path / "ttyRobot"
    words = command("board", "emulate", "create2", "--port", str(port))
    process = begun(words, stdin=subprocess.PIPE)
    try:
        assert line(process.stdout) == f"create2 at {port}; Ctrl+C ends it"
        assert line(process.stdout).startswith("off, left 0 mm/s, right 0 mm/s; x 0.00")
        said = line(process.stderr)
        assert said.startswith("rems: type what is to happen: bump left|right|both|non")
        while not said.endswith("fine"):
            assert len(said) <= 80
            said = line(process.stderr)
        taken = rems("board", "emulate", "create2", "--port", str(port))
        assert taken.returncode == 2
        assert "something at" in taken.stderr
        assert process.stdin is not None
        print("unplg 60\nunplug 60", file=process.stdin, flush=True)
        assert "Did you mean 'unplug'?" in line(process.stderr)
        until(lambda: not port.exists())
    finally:
        process.terminate()
        _, complaints = process.communicate(timeout=20)
    assert (process.returncode, complaints) == (0, "")


def line(stream: IO[str] | None) -> str:
    assert stream is not None
    return stream.readline().rstrip("\n")


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("create3",), "'create3' cannot be emulated; expected one of woodbot, "),
        (("create2", "--port", "none/port"), "no port can be put at none/port: No"),
    ],
)
def test_mistakes(rems: Run, args: tuple[str, ...], says: str) -> None:
    pytest.importorskip("pty", reason="there are no pseudo-terminals here")
    done = rems("board", "emulate", *args)
    assert done.returncode != 0
    assert says in done.stderr
    assert "Traceback" not in done.stderr

"""The console: lines of text and packets of Improv on one line, byte for byte."""

import subprocess
import zlib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from rems_net.cable import improv
from rems_net.cable.improv import Command
from tests.firmware.console.robot import Robot

SECRET = "correct horse"


def say(robot: Robot, command: str, end: bytes = b"ok\r\n") -> str:
    robot.write(command.encode() + b"\n")
    return robot.read_until(end).decode()


@pytest.fixture
def robot(robot: Robot) -> Robot:
    robot.read_until(b"Type help.\r\n")
    return robot


def test_what_a_person_types(robot: Robot) -> None:
    assert say(robot, "status") == "robot/woodbot on rems\r\nwifi: off\r\nok\r\n"
    assert "test servos" in say(robot, "help")
    assert say(robot, "test sensors") == "sensors: all there\r\nok\r\n"
    assert say(robot, "set name woodbot-7") == "ok\r\n"
    assert say(robot, "get name") == "name woodbot-7\r\nok\r\n"
    assert say(robot, "set left_trim -12.5") == "ok\r\n"
    assert say(robot, "get left_trim") == "left_trim -12.5\r\nok\r\n"
    # what is typed is what is taken: rubbed out, and ended as terminals do
    robot.write("set name ä\x7fboo\x08\x08\x08rob\r\n".encode())
    assert robot.read_until(b"\r\n") == b"ok\r\n"
    assert "name rob\r\n" in say(robot, "get")
    robot.write(b"reset\n")
    robot.read_until(b"This is Woodbot rob. Type help.\r\n")
    assert say(robot, "forget") == "ok\r\n"
    assert say(robot, "get name") == "name woodbot\r\nok\r\n"


@pytest.mark.parametrize(
    ("command", "sentence"),
    [
        ("set name -x", "expected 1 to 32 letters, digits, '_', '-' or '.', first a"),
        ("set name " + "x" * 33, "expected 1 to 32 letters"),
        ("set name", "expected 1 to 32 letters"),
        ("set", "expected: set NAME VALUE"),
        ("set nmae x", "there is no setting of that name; `get` lists them"),
        ("get nmae", "there is no setting of that name; `get` lists them"),
        ("set source keys", "expected KIND/NAME, such as input/keys, or nothing"),
        ("set router 192.168.1.20", "expected tcp/ADDRESS:PORT, such as tcp/192.168."),
        ("set router tcp/a:0", "expected tcp/ADDRESS:PORT"),
        ("set router tcp/a:65536", "expected tcp/ADDRESS:PORT"),
        ("set router tcp/:7447", "expected tcp/ADDRESS:PORT"),
        ("set ssid " + "x" * 33, "it is too long"),
        ("set left_trim 501", "expected a number of microseconds from -500 to 500"),
        ("set left_trim nan", "expected a number of microseconds"),
        ("set left_trim 1e3", "expected a number of microseconds"),
        ("set left_reversed true", "expected yes or no"),
        ("test everything", "expected: test servos, or test sensors"),
        ("stauts", "there is no such command; `help` lists them"),
        ("set ssid a\x07b", "expected a line of UTF-8 text"),
        ("x" * 300, "the line is too long"),
    ],
)
def test_what_is_wrong_is_told(robot: Robot, command: str, sentence: str) -> None:
    said = say(robot, command, b"\r\n")
    assert said.startswith(f"error: {sentence}"), said
    assert say(robot, "get name") == "name woodbot\r\nok\r\n"


def test_no_password_is_ever_printed(robot: Robot) -> None:
    said = say(robot, f"set password {SECRET}")
    said += say(robot, "get password") + say(robot, "get") + say(robot, "status")
    assert "password (set)\r\n" in said
    # nor of a line that was mistyped
    said += say(robot, f"sett password {SECRET}", b"\r\n")
    said += say(robot, f"set pasword {SECRET}", b"\r\n")
    said += say(robot, f"{SECRET}{'x' * 300}", b"\r\n")
    assert SECRET not in said


# -- what is stored -----------------------------------------------------------


def stored(lines: bytes, magic: bytes = b"WBS1") -> bytes:
    counted = len(lines).to_bytes(2, "little") + lines
    return magic + zlib.crc32(counted).to_bytes(4, "little") + counted


def after(program: Path, tmp_path: Path, kept: bytes, said: bytes = b"get\n") -> bytes:
    """What a robot with these settings answers, over a pipe."""
    file = tmp_path / "kept"
    file.write_bytes(kept)
    done = subprocess.run(
        [program, file], input=said, capture_output=True, timeout=60, check=False
    )
    assert (done.returncode, done.stderr) == (0, b"")
    return done.stdout


def test_settings_come_back(program: Path, tmp_path: Path) -> None:
    lines = b"name=w7\nssid=B\xc3\xbcro=1\nleft_trim=2.25\nof_tomorrow=1\n"
    said = after(program, tmp_path, stored(lines))
    for line in ("name w7", "ssid Büro=1", "left_trim 2.25", "fabric rems"):
        assert f"\r\n{line}\r\n".encode() in said


@pytest.mark.parametrize(
    "kept",
    [
        b"",
        b"WBS1",
        stored(b"name=w7\n", magic=b"WBS2"),
        stored(b"name=w7"),
        stored(b"name=w7\nname\n"),
        stored(b"name=w7\nleft_trim=999\n"),
        stored(b"name=w7\nssid=\xff\n"),
        stored(b"name=w7\x00\n"),
        stored(b"name=w7\n")[:-1],
        stored(b"name=w7\n") + b"\n",
        stored(b"name=w7\n").replace(b"w7", b"w8"),
        stored(b"name=w7\n" * 200),
    ],
)
def test_what_does_not_check_is_as_if_nothing_were_stored(
    program: Path, tmp_path: Path, kept: bytes
) -> None:
    assert b"This is Woodbot woodbot." in after(program, tmp_path, kept)


slowly = settings(
    max_examples=30,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


@slowly
@given(st.binary(max_size=1100), st.booleans())
def test_no_bytes_that_are_stored_crash(
    program: Path, tmp_path: Path, kept: bytes, summed: bool
) -> None:
    after(program, tmp_path, stored(kept[:1000]) if summed else kept)


WORDS = st.sampled_from(
    [
        b"get password\n",
        b"get\n",
        b"set password ",
        b"set ssid x\n",
        b"status\n",
        b"help\n",
        b"\n",
        b"IMPROV\x01\x03",
        improv.command(Command.STATE),
        improv.command(Command.INFO),
        improv.command(Command.SCAN),
        improv.command(Command.WIFI, "lab-net", "nothing of it"),
        improv.command(Command.WIFI, "lab-net", SECRET),
    ]
)


@slowly
@given(st.lists(st.one_of(WORDS, st.binary(max_size=40)), max_size=30))
def test_no_bytes_on_the_line_crash_or_print_a_password(
    program: Path, tmp_path: Path, said: list[bytes]
) -> None:
    kept = stored(f"ssid=lab-net\npassword={SECRET}\n".encode())
    answer = after(program, tmp_path, kept, b"".join(said) + b"\nget password\n")
    assert SECRET.encode() not in answer
    assert b"nothing of it" not in answer


# -- the line, told apart -----------------------------------------------------

"""The console: lines of text and packets of Improv on one line, byte for byte."""

from __future__ import annotations

import subprocess
import zlib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rems_net.cable import improv
from rems_net.cable.improv import Command, Kind
from rems_net.cable.splitter import Piece, Splitter
from tests.firmware.console.robot import Robot

SECRET = "correct horse"
#: an answer of Improv's: no error, then what was asked for
FINE = b"\nIMPROV\x01\x02\x01\x00\xe1\n"


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


def test_golden_packets_of_improv(robot: Robot) -> None:
    """From the specification: written by hand, read by hand."""
    robot.write(b"IMPROV\x01\x03\x02\x02\x00\xe5\n")
    ready = b"\nIMPROV\x01\x01\x01\x02\xe2\n"
    assert robot.read_until(ready) == FINE + ready
    robot.write(b"IMPROV\x01\x03\x02\x03\x00\xe6\n")
    info = b"\x10rems_net woodbot\x050.1.0\x05posix\x07woodbot"
    result = b"IMPROV\x01\x04\x27\x03\x25" + info
    assert len(info) == 0x25
    packet = b"\n" + result + bytes([sum(result) % 256]) + b"\n"
    assert robot.read_until(packet) == FINE + packet
    robot.write(b"IMPROV\x01\x03\x02\x63\x00\x46\n")
    unknown = b"\nIMPROV\x01\x02\x01\x02\xe3\n"
    assert robot.read_until(unknown) == FINE + unknown
    robot.write(b"IMPROV\x01\x03\x02\x02\x00\xe6\n")  # a wrong sum
    invalid = b"\nIMPROV\x01\x02\x01\x01\xe2\n"
    assert robot.read_until(invalid) == invalid


def test_a_packet_is_found_in_the_middle_of_a_line(robot: Robot) -> None:
    robot.write(b"get naIMPROVIMPROV\x01\x03\x02\x02\x00\xe5\nget name\n")
    said = robot.read_until(b"ok\r\n")
    assert said.startswith(FINE)
    assert said.endswith(b"name woodbot\r\nok\r\n")


def test_half_a_packet_does_not_hold_the_line(robot: Robot) -> None:
    robot.write(b"IMPROV\x01\x03\xff\x01")
    said = b""
    for _ in range(100):  # lines that are taken for its data, until it is too late
        robot.write(b"\nget name\n")
        try:
            said = robot.read_until(b"ok\r\n", seconds=0.3)
        except AssertionError:
            continue
        break
    assert said.endswith(b"name woodbot\r\nok\r\n")


def wifi(robot: Robot, ssid: str, password: str) -> list[tuple[Kind, bytes]]:
    """What comes of it: up to a result, or an error."""
    robot.write(improv.command(Command.WIFI, ssid, password))
    splitter, packets, ends = Splitter(), [], (Kind.RESULT, Kind.ERROR)
    while True:
        for piece in splitter.feed(robot.read_until(b"\n")):
            if piece.kind == "packet":
                packets.append(improv.read(piece.content))
        if [p for p in packets if p[0] in ends and p != (Kind.ERROR, b"\0")]:
            return packets


def test_improv_sets_the_network(robot: Robot) -> None:
    assert wifi(robot, "lab-net", SECRET) == [
        (Kind.ERROR, b"\0"),
        (Kind.STATE, b"\3"),
        (Kind.STATE, b"\4"),
        (Kind.RESULT, b"\1\0"),
    ]
    stored = robot.settings.read_bytes()
    assert b"ssid=lab-net\n" in stored
    # a wrong password is told, and what worked comes back
    assert wifi(robot, "lab-net", "wrong horse")[2:3] == [(Kind.ERROR, b"\3")]
    assert robot.settings.read_bytes() == stored
    assert "ssid lab-net" in say(robot, "get ssid")
    robot.write(b"status\n")
    robot.read_until(b"robot/woodbot on rems")


def test_a_wrong_wifi_packet_changes_nothing(robot: Robot) -> None:
    for data in (b"\1\0", b"\1\1\0", b"\1\5\5lab", b"\1\3\1\0\0", b"\1\4\1x\x01\xff"):
        robot.write(improv.packet(Kind.RPC, data))
        robot.read_until(b"\nIMPROV\x01\x02\x01\x01\xe2\n")
    assert say(robot, "get ssid") == "ssid \r\nok\r\n"


def test_a_device_name_is_the_robots(robot: Robot) -> None:
    data = b"woodbot-9"
    robot.write(improv.packet(Kind.RPC, bytes([Command.NAME, len(data)]) + data))
    robot.read_until(b"\x06\x0a\x09woodbot-9")
    assert "woodbot-9" in say(robot, "get name")
    robot.write(improv.packet(Kind.RPC, b"\x06\x02a/"))
    robot.read_until(b"\nIMPROV\x01\x02\x01\x05\xe6\n")


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
    deadline=None,
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


@settings(deadline=None)
@given(st.data())
def test_any_portions_split_alike(data: st.DataObject) -> None:
    pieces = data.draw(
        st.lists(
            st.one_of(
                st.text("ab äIMPROV", min_size=1).map(lambda t: ("text", t.encode())),
                st.binary(max_size=255).map(
                    lambda b: ("packet", improv.packet(Kind.RESULT, b)[1:-1])
                ),
                st.binary(min_size=1)
                .map(lambda b: b.replace(b"\xc0", b""))
                .filter(bool)
                .map(lambda b: ("frame", b)),
            )
        )
    )
    line = b""
    for kind, content in pieces:
        line += {
            "text": content + b"\r\n",
            "packet": b"\n" + content + b"\n",
            "frame": b"\xc0" + content + b"\xc0",
        }[kind]
    splitter, got = Splitter(), []
    while line:
        size = data.draw(st.integers(1, 64))
        got += splitter.feed(line[:size])
        line = line[size:]
    assert [tuple(piece) for piece in got] == pieces


def test_a_frame_interrupts_a_line() -> None:
    pieces = Splitter().feed(b"get \xc0abc\xc0name\n")
    assert pieces == [Piece("frame", b"abc"), Piece("text", b"get name")]

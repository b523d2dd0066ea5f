"""Improv Serial at a robot's cable: packets among lines, and what they set."""

import pytest
from hypothesis import given, strategies as st

from rems_net.cable import improv
from rems_net.cable.improv import Command, Kind
from rems_net.cable.splitter import Piece, Splitter
from tests.firmware.console.robot import Robot
from tests.firmware.console.test_console import SECRET, say

#: an answer of Improv's: no error, then what was asked for
FINE = b"\nIMPROV\x01\x02\x01\x00\xe1\n"


@pytest.fixture
def robot(robot: Robot) -> Robot:
    robot.read_until(b"Type help.\r\n")
    return robot


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

"""Packets of protocol 2.0, byte by byte: those that ROBOTIS and the SDK publish."""

import pytest
from hypothesis import given, strategies as st

from rems_net.emulators.dynamixel.packet import (
    HEADER,
    Instruction,
    Packet,
    Reader,
    encode,
    status,
)

SYNC_READ, SYNC_WRITE = Instruction.SYNC_READ, Instruction.SYNC_WRITE
#: the packet without its header, and what it says
PUBLISHED = {
    "01 03 00 01 19 4E": (1, Instruction.PING, ""),
    "01 07 00 55 00 06 04 26 65 5D": (1, Instruction.STATUS, "00 06 04 26"),
    "01 07 00 02 84 00 04 00 1D 15": (1, Instruction.READ, "84 00 04 00"),
    "01 09 00 03 74 00 00 02 00 00 CA 89": (1, Instruction.WRITE, "74 00 00 02 00 00"),
    "01 04 00 55 00 A1 0C": (1, Instruction.STATUS, "00"),
    "01 06 00 03 40 00 01 DB 66": (1, Instruction.WRITE, "40 00 01"),
    "01 06 00 03 0B 00 01 47 63": (1, Instruction.WRITE, "0B 00 01"),
    "01 06 00 03 0B 00 04 59 63": (1, Instruction.WRITE, "0B 00 04"),
    "01 09 00 03 68 00 53 00 00 00 E7 D5": (1, Instruction.WRITE, "68 00 53 00 00 00"),
    "01 09 00 03 68 00 AD FF FF FF CD C1": (1, Instruction.WRITE, "68 00 AD FF FF FF"),
    "FE 09 00 82 84 00 04 00 01 02 CE FA": (254, SYNC_READ, "84 00 04 00 01 02"),
    "FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87": (
        254,
        SYNC_WRITE,
        "74 00 04 00 01 96 00 00 00 02 AA 00 00 00",
    ),
    "FE 11 00 83 68 00 04 00 01 53 00 00 00 02 AD FF FF FF 70 4C": (
        254,
        SYNC_WRITE,
        "68 00 04 00 01 53 00 00 00 02 AD FF FF FF",
    ),
    "01 06 00 03 62 00 19 23 64": (1, Instruction.WRITE, "62 00 19"),
    "01 03 00 08 2F 4E": (1, Instruction.REBOOT, ""),
}


@pytest.mark.parametrize("text", PUBLISHED)
def test_the_published_packets(text: str) -> None:
    servo, instruction, parameters = PUBLISHED[text]
    data = HEADER + bytes.fromhex(text)
    given = bytes.fromhex(parameters)
    assert encode(servo, instruction, given) == data
    assert Reader().feed(data) == [Packet(servo, instruction, given)]
    if instruction == Instruction.STATUS:
        assert status(servo, given[0], given[1:]) == data


def test_what_looks_like_a_header_is_stuffed() -> None:
    data = encode(1, Instruction.WRITE, b"\x74\x00\xff\xff\xfd\x00")
    assert data[8:15] == b"\x74\x00\xff\xff\xfd\xfd\x00"
    assert data[5:7] == b"\x0a\x00", "the length counts what was stuffed"
    assert data.count(HEADER) == 1


packets = st.builds(
    Packet,
    servo=st.integers(0, 0xFC),
    instruction=st.sampled_from(Instruction),
    parameters=st.lists(
        st.sampled_from([b"\xff", b"\xfd", b"\x00", b"\xff\xff\xfd", b"\x42"]),
        max_size=12,
    ).map(b"".join),
    whole=st.just(True),
)


@given(st.lists(packets, max_size=4), st.integers(1, 9), st.binary(max_size=6))
def test_whatever_is_said_is_read(said: list[Packet], size: int, noise: bytes) -> None:
    """In portions of any size, behind noise in which no packet begins."""
    data = noise.replace(b"\xff", b"\x00")
    data += b"".join(encode(*packet[:3]) for packet in said)
    reader, found = Reader(), []
    for at in range(0, len(data), size):
        found += reader.feed(data[at : at + size])
    assert found == said


@given(packets, st.integers(0), st.integers(0, 7))
def test_one_wrong_bit_is_noticed(packet: Packet, at: int, bit: int) -> None:
    data = bytearray(encode(*packet[:3]))
    data[at % len(data)] ^= 1 << bit
    assert not any(one.whole for one in Reader().feed(bytes(data)))


def test_a_damaged_packet_hides_no_other() -> None:
    damaged = bytearray(encode(1, Instruction.PING))
    damaged[8] ^= 4
    found = Reader().feed(bytes(damaged) + encode(2, Instruction.PING))
    assert [(one.servo, one.whole) for one in found] == [(1, False), (2, True)]

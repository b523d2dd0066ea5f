"""Packets of DYNAMIXEL protocol 2.0, byte by byte.

FF FF FD 00 | ID | length, 2 bytes | instruction | parameters | CRC, 2 bytes. The length
counts what follows it. Source: ROBOTIS e-Manual, DYNAMIXEL Protocol 2.0.
"""

from enum import IntEnum
from typing import NamedTuple

HEADER = b"\xff\xff\xfd\x00"
#: Bytes that would look like a header, and what is sent instead.
MARK, STUFFED = b"\xff\xff\xfd", b"\xff\xff\xfd\xfd"
BROADCAST = 0xFE
#: Bytes before those that the length counts; largest value of the length.
HEAD, LONGEST = 7, 1024


class Instruction(IntEnum):
    """Instructions of packets; STATUS is the answer."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    FACTORY_RESET = 0x06
    REBOOT = 0x08
    CLEAR = 0x10
    STATUS = 0x55
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83
    BULK_READ = 0x92
    BULK_WRITE = 0x93


class Packet(NamedTuple):
    """One packet, without header, stuffing and CRC. `whole`: its CRC is right."""

    servo: int
    instruction: int
    parameters: bytes
    whole: bool = True


def _table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ (0x8005 if crc & 0x8000 else 0)
        table.append(crc & 0xFFFF)
    return tuple(table)


_CRC = _table()


def checksum(data: bytes) -> int:
    """Return the CRC-16 of a packet up to its last parameter (polynomial 0x8005)."""
    crc = 0
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _CRC[crc >> 8 ^ byte]
    return crc


def encode(servo: int, instruction: int, parameters: bytes = b"") -> bytes:
    """Return the bytes of a packet."""
    body = (bytes([instruction]) + parameters).replace(MARK, STUFFED)
    data = HEADER + bytes([servo]) + (len(body) + 2).to_bytes(2, "little") + body
    return data + checksum(data).to_bytes(2, "little")


def status(servo: int, error: int = 0, parameters: bytes = b"") -> bytes:
    """Return the bytes of a status packet."""
    return encode(servo, Instruction.STATUS, bytes([error]) + parameters)


class Reader:
    """Parser of packets in a stream of bytes, however it is split."""

    def __init__(self) -> None:
        self._left = b""

    def clear(self) -> None:
        """Drop an unfinished packet: no byte has followed it for too long."""
        self._left = b""

    def feed(self, portion: bytes) -> list[Packet]:
        """Return the complete packets; a damaged one has `whole` False."""
        self._left += portion
        found = []
        while (packet := self._next()) is not None:
            found.append(packet)
        return found

    def _next(self) -> Packet | None:
        while True:
            at = self._left.find(HEADER)
            if at < 0:
                # The beginning of a header may be at the end.
                self._left = self._left[-3:]
                return None
            data = self._left = self._left[at:]
            if len(data) < HEAD:
                return None
            size = int.from_bytes(data[5:7], "little")
            if not 3 <= size <= LONGEST:
                self._left = data[len(HEADER) :]
                continue
            if len(data) < HEAD + size:
                return None
            end = HEAD + size
            whole = (
                checksum(data[: end - 2]).to_bytes(2, "little") == data[end - 2 : end]
            )
            # A damaged packet may contain the beginning of the next.
            self._left = data[end if whole else len(HEADER) :]
            body = data[HEAD : end - 2].replace(STUFFED, MARK)
            return Packet(data[4], body[0], body[1:], whole)

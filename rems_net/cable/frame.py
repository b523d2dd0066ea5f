"""Frames: the data of a session on the cable, beside the console.

`cable/cable.h` of the firmware is the other side. A frame is between two bytes 0xC0,
escaped as in SLIP: kind, connection, number, payload, CRC-32.
"""

import struct
import zlib
from enum import IntEnum
from typing import NamedTuple

from rems_net.errors import WireError

#: Bytes. Most data in one frame.
PAYLOAD = 256
_HEAD, _SUM = struct.Struct("<BHB"), struct.Struct("<I")


class Kind(IntEnum):
    """Kinds of frames."""

    DATA = 1
    ACK = 2
    CLOSE = 3


class Frame(NamedTuple):
    """One frame. Numbers are modulo 256."""

    kind: Kind
    connection: int
    number: int = 0
    payload: bytes = b""

    def to_line(self) -> bytes:
        """Return its bytes on the line."""
        whole = _HEAD.pack(self.kind, self.connection, self.number) + self.payload
        whole += _SUM.pack(zlib.crc32(whole))
        escaped = whole.replace(b"\xdb", b"\xdb\xdd").replace(b"\xc0", b"\xdb\xdc")
        return b"\xc0" + escaped + b"\xc0"


def read(content: bytes) -> Frame:
    """Return the frame in the bytes from a Splitter. Raises WireError if damaged."""
    whole = content.replace(b"\xdb\xdc", b"\xc0").replace(b"\xdb\xdd", b"\xdb")
    if not _HEAD.size + _SUM.size <= len(whole) <= PAYLOAD + 8:
        raise WireError(f"no frame has {len(whole)} bytes (R0621)")
    body, sum_ = whole[: -_SUM.size], _SUM.unpack(whole[-_SUM.size :])[0]
    if zlib.crc32(body) != sum_:
        raise WireError("a frame has a wrong sum: it was damaged (R0621)")
    kind, connection, number = _HEAD.unpack_from(body)
    try:
        return Frame(Kind(kind), connection, number, body[_HEAD.size :])
    except ValueError:
        raise WireError(f"no frame is of kind {kind} (R0621)") from None

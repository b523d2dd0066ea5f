"""Pictures: arrays of u1, (height, width, 3), and PNG files."""

import re
import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict import Field

SIGNATURE = b"\x89PNG\r\n\x1a\n"
#: 8 bits a colour, the type "red, green, blue", and the only packing that PNG has
KIND = bytes([8, 2, 0, 0, 0])
#: characters with a meaning in folder names on some system
_ODD = re.compile(r"[^\w.-]")


def is_picture(one: Field | NDArray[Any]) -> bool:
    """Return whether a field or an array holds red, green and blue by row and pixel."""
    kind = str(one.dtype)
    return kind in ("u1", "uint8") and len(one.shape) == 3 and one.shape[2] == 3


def album(agent: str, port: str, path: str) -> str:
    """Return the folder name of one camera's pictures: `bot.camera`."""
    name = path if port == "sensors" else f"{port}/{path}"
    # A field may have any name, and on Windows "\\" and ":" lead to other folders.
    return f"{agent}.{_ODD.sub('_', name.replace('/', '.'))}"


def png(picture: NDArray[np.uint8]) -> bytes:
    """Return a picture (height, width, 3) of red, green and blue as a PNG file."""
    height, width, _ = picture.shape
    # Each row begins with the number of its filter: 0, none.
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = picture.reshape(height, 3 * width)
    head = struct.pack(">II", width, height) + KIND
    pixels = zlib.compress(rows.tobytes())
    chunks = (b"IHDR", head), (b"IDAT", pixels), (b"IEND", b"")
    return SIGNATURE + b"".join(_chunk(name, data) for name, data in chunks)


def pixels(data: bytes) -> NDArray[np.uint8]:
    """Return the picture (height, width, 3) in a PNG file that `png` has made.

    Raises ValueError for any other file.
    """
    chunks = dict(_chunks(data))
    head, packed = chunks.get(b"IHDR", b""), chunks.get(b"IDAT", b"")
    if len(head) != 8 + len(KIND) or head[8:] != KIND:
        raise ValueError
    width, height = struct.unpack(">II", head[:8])
    size = height * (1 + 3 * width)
    try:
        rows = zlib.decompressobj().decompress(packed, size + 1)
    except zlib.error:
        raise ValueError from None
    if len(rows) != size or any(rows[:: 1 + 3 * width]):
        raise ValueError
    table = np.frombuffer(rows, np.uint8).reshape(height, 1 + 3 * width)
    return table[:, 1:].reshape(height, width, 3)


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = len(SIGNATURE)
    while data.startswith(SIGNATURE) and at + 8 <= len(data):
        size = int.from_bytes(data[at : at + 4], "big")
        yield data[at + 4 : at + 8], data[at + 8 : at + 8 + size]
        at += 12 + size


def _chunk(name: bytes, data: bytes) -> bytes:
    check = zlib.crc32(name + data)
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", check)

"""Pictures: arrays of u1, (height, width, 3), and as files that everything can show."""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict import Field

SIGNATURE = b"\x89PNG\r\n\x1a\n"
#: bits of a colour, the kind "red, green, blue", and the only ways of packing
KIND = bytes([8, 2, 0, 0, 0])


def is_picture(one: Field | NDArray[Any]) -> bool:
    """Whether a field or an array holds red, green and blue of pixels, row by row."""
    kind = str(one.dtype)
    return kind in ("u1", "uint8") and len(one.shape) == 3 and one.shape[2] == 3


def album(agent: str, port: str, path: str) -> str:
    """Return what the folder of one camera's pictures is called: `bot.camera`."""
    name = path if port == "sensors" else f"{port}/{path}"
    return f"{agent}.{name.replace('/', '.')}"


def png(picture: NDArray[np.uint8]) -> bytes:
    """Return a picture (height, width, 3) of red, green and blue as a PNG file."""
    height, width, _ = picture.shape
    # Each row begins with how it is filtered: not at all.
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = picture.reshape(height, 3 * width)
    head = struct.pack(">II", width, height) + KIND
    pixels = zlib.compress(rows.tobytes())
    chunks = (b"IHDR", head), (b"IDAT", pixels), (b"IEND", b"")
    return SIGNATURE + b"".join(_chunk(name, data) for name, data in chunks)


def _chunk(name: bytes, data: bytes) -> bytes:
    check = zlib.crc32(name + data)
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", check)

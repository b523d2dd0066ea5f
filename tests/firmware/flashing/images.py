"""A small image for tests, laid out as the board's own."""

import hashlib
import json
import random
import re
import struct
from pathlib import Path

from tests.firmware.compiling import CORE

#: where the partition for settings is: start and size
NVS = (0x9000, 0x5000)
#: of an application; it has to be enough for several blocks of data
APPLICATION = 70_000


def table() -> bytes:
    """Return a partition table: settings, then an application."""
    entry = "<2sBBII16sI"
    rows = [(1, 2, *NVS, b"nvs"), (0, 0x10, 0x10000, 0x140000, b"app0")]
    made = b"".join(
        struct.pack(entry, b"\xaa\x50", kind, of_kind, start, size, label, 0)
        for kind, of_kind, start, size, label in rows
    )
    return made.ljust(0xC00, b"\xff")


def content() -> bytes:
    """Return a boot loader, a partition table and an application, merged."""
    made = bytearray(b"\xff" * (0x10000 + APPLICATION))
    numbers = random.Random(1)
    made[0x1000:0x1400] = b"\xe9" + numbers.randbytes(0x3FF)
    made[0x8000:0x8C00] = table()
    made[0x10000:] = b"\xe9" + numbers.randbytes(APPLICATION - 1)
    return bytes(made)


def schemas() -> dict[str, str]:
    """Return the digests that are compiled into the firmware."""
    text = (CORE / "woodbot_schemas.c").read_text(encoding="utf-8")
    return dict(re.findall(r'port = "(\w+)".*?digest = "(\w+)"', text, re.DOTALL))


def write(folder: Path, **changed: object) -> Path:
    """Write an image and its manifest; `changed` are fields of the manifest."""
    path = folder / "woodbot-0.1.0.bin"
    made = content()
    path.write_bytes(made)
    manifest = {
        "chip": "esp32",
        "offset": 0,
        "bytes": len(made),
        "sha256": hashlib.sha256(made).hexdigest(),
        "version": "0.1.0",
        "schemas": schemas(),
    }
    path.with_suffix(".json").write_text(json.dumps(manifest | changed))
    return path

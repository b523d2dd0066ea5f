"""Image: the content of a board's flash, and the manifest beside it.

`deploy/board/make_image.py` writes both: `woodbot-0.1.0.bin`, and `woodbot-0.1.0.json`
with the chip, the offset in its flash, the size and the SHA-256 of the image.
"""

import hashlib
import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rems_net.errors import ExperimentError

#: Bytes. The largest flash of an ESP32 board; a larger file is no image.
LARGEST = 16 << 20
#: Bytes. A manifest has ten lines.
LARGEST_MANIFEST = 16 << 10
#: Chips, as esptool names them.
CHIPS = ("esp32",)
#: ESP-IDF's partition table: its place in the flash, bytes of one entry, the bytes
#: that an entry begins with, type and subtype of the partition for settings (NVS).
TABLE, ENTRY, MAGIC, SETTINGS = 0x8000, 32, b"\xaa\x50", (1, 2)


@dataclass(frozen=True)
class Image:
    """An image that matches its manifest.

    offset: bytes from the start of the flash.
    schemas: port -> digest of its schema.
    """

    path: Path
    content: bytes
    chip: str
    offset: int
    version: str
    schemas: dict[str, str]

    def parts(self) -> list[tuple[int, bytes]]:
        """Return the parts to be written: pairs of an offset in the flash, and bytes.

        The partition for settings is left out, so that a robot keeps its name, its
        network and its trim when it gets a newer image.
        """
        gap = self._settings()
        if gap is None:
            return [(self.offset, self.content)]
        start, end = (at - self.offset for at in gap)
        found = [(self.offset, self.content[:start])]
        return [*found, (end + self.offset, self.content[end:])]

    def _settings(self) -> tuple[int, int] | None:
        """Return start and end in the flash of the partition for settings."""
        table = self.content[max(0, TABLE - self.offset) :]
        last = self.offset + len(self.content)
        for at in range(0, min(len(table), 3072) - ENTRY + 1, ENTRY):
            magic, kind, of_kind, start, size = struct.unpack_from("<2sBBII", table, at)
            if magic != MAGIC:
                break
            if (kind, of_kind) == SETTINGS and self.offset < start < last - size:
                return start, start + size
        return None


def load(path: Path) -> Image:
    """Return the image of a file, checked against its manifest.

    Raises ExperimentError if image or manifest is missing, or they do not match.
    """
    if path.suffix != ".bin":
        raise ExperimentError(
            f"{path} is no image: expected a file that ends in .bin, such as "
            "woodbot-0.1.0.bin. (R0704)"
        )
    content = _read(path, LARGEST)
    manifest = _manifest(path.with_suffix(".json"), path.name)
    found = hashlib.sha256(content).hexdigest()
    if (len(content), found) != (manifest["bytes"], manifest["sha256"].lower()):
        raise ExperimentError(
            f"{path} is damaged, or it is another image than {path.stem}.json "
            f"describes: it has {len(content)} bytes and the SHA-256 {found[:12]}..., "
            f"expected {manifest['bytes']} and {manifest['sha256'][:12]}.... Nothing "
            "was written. Copy both files once more. (R0704)"
        )
    read = ("chip", "offset", "version", "schemas")
    return Image(path, content, *(manifest[name] for name in read))


def _manifest(path: Path, image: str) -> dict[str, Any]:
    """Return the manifest; all fields that are used are there, with the right type."""
    if not path.exists():
        raise ExperimentError(
            f"{path} is missing: it names the chip and the checksum of {image}. "
            "Copy it to the same folder. (R0704)"
        )
    text = _read(path, LARGEST_MANIFEST)
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise ExperimentError(
            f"{path} is damaged: expected JSON. Copy it once more. (R0704)"
        ) from None
    kinds = {"chip": str, "offset": int, "bytes": int, "sha256": str, "version": str}
    kinds["schemas"] = dict
    for name, kind in kinds.items():
        if not isinstance(found, dict) or type(found.get(name)) is not kind:
            raise ExperimentError(
                f"{path} has no {name} that can be read. It is no manifest of an "
                "image: copy it once more. (R0704)"
            )
    if found["chip"] not in CHIPS or not 0 <= found["offset"] < LARGEST:
        raise ExperimentError(
            f"{path} is for the chip {found['chip']!r} at offset {found['offset']}; "
            f"expected {', '.join(CHIPS)}, and an offset from 0 to {LARGEST - 1}."
            " (R0704)"
        )
    manifest: dict[str, Any] = found
    return manifest


def _read(path: Path, most: int) -> bytes:
    """Return a file's bytes. Raises ExperimentError if it is unreadable, or huge."""
    try:
        if not path.is_file():
            raise FileNotFoundError
        if (size := path.stat().st_size) > most:
            raise ExperimentError(
                f"{path} has {size} bytes; expected {most} at most. It is no image."
                " (R0704)"
            )
        return path.read_bytes()
    except FileNotFoundError:
        raise ExperimentError(
            f"There is no file {path}. Type the path of the image that your teacher "
            "gave you, or make one, as in docs/firmware.md. (R0704)"
        ) from None
    except OSError as error:
        raise ExperimentError(
            f"{path} can't be read: {error.strerror}. (R0704)"
        ) from None

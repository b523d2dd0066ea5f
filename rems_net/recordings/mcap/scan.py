"""Reading a file of ours from its beginning, and finishing one that has no end."""

from pathlib import Path
from typing import IO
from zlib import crc32

import numpy as np

from rems_net.errors import ExperimentError
from rems_net.recordings.mcap import records as mcap
from rems_net.recordings.mcap.index import Index
from rems_net.recordings.mcap.records import ChunkIndex
from rems_net.recordings.mcap.writer import LIBRARY, McapWriter

#: bytes of the longest record that is read
LONGEST = 1 << 28


def is_whole(path: Path) -> bool:
    """Return whether a file has its end. Raises OSError."""
    with path.open("rb") as file:
        file.seek(0, 2)
        if file.tell() < mcap.END + len(mcap.MAGIC):
            return False
        file.seek(-mcap.END, 2)
        end = file.read()
        head = mcap.HEAD.pack(mcap.FOOTER, mcap.FOOTER_FIELDS.size)
        return end.startswith(head) and end.endswith(mcap.MAGIC)


def finish(path: Path, *, damaged: bool = False) -> bool:
    """Give a file whose writer was killed its summary and its end.

    damaged: whether to write both anew. Returns False if it has them. Bytes behind the
    last whole chunk are cut off. Raises OSError, and ExperimentError for a file that is
    no recording.
    """
    if is_whole(path) and not damaged:
        return False
    writer = scan(path)
    if writer.library != LIBRARY:
        raise ExperimentError(
            f"{path.name} is of another program ({writer.library}), whose records "
            "would be lost: repair it with that. (R0805)"
        )
    writer.resume()
    writer.close()
    return True


def scan(path: Path) -> McapWriter:
    """Read all whole chunks of a file, to go on behind them.

    Raises OSError, and ExperimentError for a file that is no recording of ours.
    """
    made = McapWriter(path)
    with path.open("rb") as file:
        check_magic(file, path.name)
        _grow(made, mcap.MAGIC)
        while (found := _next(file)) is not None:
            opcode, content = found
            if opcode in (mcap.HEADER, mcap.METADATA):
                cursor = mcap.Cursor(content)
                name = cursor.text()
                if opcode == mcap.METADATA:
                    made.told.append((made.size, 9 + len(content), name))
                else:  # that was the profile
                    made.library = cursor.text() or LIBRARY
                _grow(made, mcap.record(opcode, content))
            elif opcode != mcap.CHUNK or not _chunk(made, file, content):
                break
    return made


def check_magic(file: IO[bytes], shown: str) -> None:
    """Read how a file begins. Raises ExperimentError for one that is no MCAP file."""
    begin = file.read(len(mcap.MAGIC))
    if not begin:
        raise ExperimentError(
            f"{shown} is empty: the process that wrote it ended before its first tick. "
            "(R0805)"
        )
    if begin != mcap.MAGIC:
        name = ", in spite of its name" if shown.endswith(".mcap") else ""
        raise ExperimentError(
            f"{shown} is no MCAP file{name}; expected the run.mcap of a run. (R0805)"
        )


def _grow(made: McapWriter, data: bytes) -> None:
    made.size += len(data)
    made.crc = crc32(data, made.crc)


def _next(file: IO[bytes]) -> tuple[int, bytes] | None:
    """Return the next record; None at the end, or for one that is cut."""
    head = file.read(mcap.HEAD.size)
    if len(head) < mcap.HEAD.size:
        return None
    opcode, size = mcap.HEAD.unpack(head)
    content = file.read(size) if size <= LONGEST else b""
    return (opcode, content) if len(content) == size else None


def _chunk(made: McapWriter, file: IO[bytes], content: bytes) -> bool:
    """Take in a chunk, and the indexes behind it. Returns whether it is whole."""
    data, start, end = opened(content, made.path.name)
    record = mcap.record(mcap.CHUNK, content)
    one = ChunkIndex(start, end, made.size, len(record), len(data))
    found: list[tuple[int, ...]] = []
    for opcode, at, inner in mcap.records(data):
        if opcode == mcap.SCHEMA:
            kind = mcap.read_schema(inner)
            made.types[kind.name] = kind
        elif opcode == mcap.CHANNEL:
            channel = mcap.read_channel(inner)
            made.channels[channel.topic.removeprefix("/")] = channel
        elif opcode == mcap.MESSAGE:
            number, _, time, _ = mcap.Cursor(inner).take("HIQQ")
            found.append((number, time, at))
    _grow(made, record)
    index = Index(*np.array(found, np.int64).reshape(-1, 3).T)
    indexes = index.behind(one)
    made.keep(one, index)
    there = file.read(len(indexes))
    if there == indexes:
        _grow(made, indexes)
        return True
    made.missing = indexes
    return False


def check_compression(compression: str, shown: str) -> None:
    """Raise ExperimentError for a chunk that is compressed."""
    if compression:
        raise ExperimentError(
            f"{shown} is compressed ({compression}); rems reads files that are not. "
            "Unpack it: mcap compress --compression none. (R0805)"
        )


def opened(content: bytes, shown: str) -> tuple[bytes, int, int]:
    """Return what is in a chunk, and its first and last time [ns].

    Raises ExperimentError for one that is compressed, or damaged.
    """
    try:
        cursor = mcap.Cursor(content)
        start, end, size, check = cursor.take("QQQI")
        compression = cursor.text()
        (length,) = cursor.take("Q")
    except ValueError:
        raise ExperimentError(
            f"{shown} is damaged: one of its chunks is cut off. Copy it "
            "once more. (R0805)"
        ) from None
    check_compression(compression, shown)
    data = content[cursor.at : cursor.at + length]
    if len(data) != size or (check and crc32(data) != check):
        raise ExperimentError(
            f"{shown} is damaged: the checksum of a chunk does not fit. "
            "Copy it once more. (R0805)"
        )
    return data, start, end

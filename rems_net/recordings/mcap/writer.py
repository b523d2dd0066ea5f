"""Writing MCAP: chunks that are whole when they are in the file, and a summary.

The bytes depend on what is recorded alone: not on the wall clock, on who came first,
or on the version of a library. Nothing is compressed, for that reason. A chunk ends
with a second of fabric time, or as soon as it has 1 MiB, and only between two ticks.
Chunks of more than 256 channels are longer, so that their indexes, which list each
channel, stay small beside them.
"""

import errno
import os
import struct
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import IO
from zlib import crc32

import numpy as np

from rems_net.defdict import Batch, Schema, canonical, ros2msg, type_name
from rems_net.recordings.mcap import records as mcap
from rems_net.recordings.mcap.derived import Derived
from rems_net.recordings.mcap.frame import Frame
from rems_net.recordings.mcap.index import NONE, Index
from rems_net.recordings.mcap.records import Channel, ChunkIndex

#: what the recording of a run is called, in its folder
FILE = "run.mcap"
#: what wrote the file: without a version, so that the bytes stay the same
LIBRARY = "rems_net"
#: what kind of file it is; programs for ROS 2 open no other
PROFILE = "ros2"
#: bytes. A chunk is closed once it has FULL, and EACH for every channel. A killed
#: process loses at most these, or a tick if that is more.
FULL, EACH = 1 << 20, 1 << 12
#: ns. A chunk never goes beyond the end of a second.
SECOND = 1_000_000_000
#: channels and types of one file: their ids have two bytes
MOST = 65535
#: name of the first record: what was run
EXPERIMENT = "rems:experiment"
#: in the metadata of a channel: its schema in full, as hexadecimal digits
SCHEMA, DIGEST, DERIVED = "rems:schema", "rems:digest", "rems:derived"
#: what programs for ROS 2 expect in the metadata of a channel, and may be empty
QOS = "offered_qos_profiles"


class McapWriter:
    """Writes one file. `add` all messages of a tick, then `end_tick`; `close` at last.

    Raises OSError; what was written before stays whole.
    """

    def __init__(self, path: Path) -> None:
        #: library: what has written what is in it
        self.path, self.library = path, LIBRARY
        self.types: dict[str, mcap.Schema] = {}
        self.channels: dict[str, Channel] = {}
        self.chunks: list[ChunkIndex] = []
        #: messages of each channel, by its id
        self._counts = np.zeros(MOST + 1, np.int64)
        #: place, length and name of each metadata record
        self.told: list[tuple[int, int, str]] = []
        #: bytes in the file, and their checksum; 0 if it is not known
        self.size = self.crc = 0
        #: message indexes that are not in the file, behind its last chunk
        self.missing = b""
        self._file: IO[bytes] | None = None
        self._frame = Frame({}, Batch())
        self._begin_chunk()

    @property
    def counts(self) -> dict[int, int]:
        """Messages of each channel that has some, by its id."""
        there = np.flatnonzero(self._counts)
        return dict(zip(there.tolist(), self._counts[there].tolist(), strict=True))

    def _begin_chunk(self) -> None:
        self._parts: list[bytes | bytearray] = []
        self._length = 0
        #: of each tick in it: its messages, its time [ns], and where they begin
        self._ticks: list[tuple[Frame, int, int]] = []

    def open(self, about: Mapping[str, str]) -> None:
        """Make the file. about: the experiment. Raises FileExistsError."""
        self._file = self.path.open("x+b", buffering=0)
        head = mcap.MAGIC
        head += mcap.record(mcap.HEADER, mcap.text(PROFILE) + mcap.text(LIBRARY))
        first = mcap.metadata(EXPERIMENT, about)
        self.told.append((len(head), len(first), EXPERIMENT))
        self._write(head + first)

    def resume(self) -> None:
        """Go on behind the last whole chunk of a file that was scanned."""
        self._file = self.path.open("r+b", buffering=0)
        self._file.truncate(self.size)
        self._file.seek(self.size)
        missing, self.missing = self.missing, b""
        self._write(missing)

    # -- what is recorded ----------------------------------------------------------

    def declare(
        self, schemas: Mapping[str, Schema], derived: Iterable[Derived] = ()
    ) -> None:
        """Add the channels of these keys, sorted. Raises ValueError for too many."""
        more = {one.key: one.type for one in derived}
        for key in sorted((schemas.keys() | more.keys()) - self.channels.keys()):
            if key in more:
                name, text = more[key]
                self.channel(key, name, text.rstrip, {QOS: "", DERIVED: "1"})
                continue
            one, port = schemas[key], key.rpartition("/")[2]
            plain = canonical(one).to_wire().hex()
            about = {QOS: "", DIGEST: one.digest, SCHEMA: plain}
            name = type_name(port, one)
            self.channel(key, name, partial(ros2msg, port, one), about)

    def channel(
        self,
        key: str,
        name: str,
        text: Callable[[], str],
        about: Mapping[str, str],
    ) -> None:
        """Add a channel. name: of its type, whose definition `text` returns."""
        if len(self.channels) == MOST:
            raise ValueError(f"it would have more than {MOST} channels")
        if name not in self.types:
            kind = mcap.Schema(len(self.types) + 1, name, "ros2msg", text().encode())
            self.types[name] = kind
            self._keep(mcap.schema(kind))
        number = len(self.channels) + 1
        one = Channel(number, self.types[name].id, f"/{key}", "cdr", about)
        self.channels[key] = one
        self._keep(mcap.channel(one))

    def _keep(self, data: bytes | bytearray) -> None:
        self._parts.append(data)
        self._length += len(data)

    def add(self, n: int, time: int, messages: Mapping[str, bytes]) -> None:
        """Add the messages of tick n, at a time [ns], by the keys of their channels."""
        batch = messages if isinstance(messages, Batch) else Batch(messages)
        if not batch and not batch.rows:
            return
        if self._ticks and time // SECOND != self._ticks[0][1] // SECOND:
            self.end_chunk()
        if not self._frame.fits(batch):
            self._frame = Frame(self.channels, batch)
        self._ticks.append((self._frame, time, self._length))
        self._keep(self._frame.filled(n, time, batch))

    def end_tick(self) -> None:
        """Close the chunk if it is full."""
        if self._length >= max(FULL, EACH * len(self.channels)):
            self.end_chunk()

    def end_chunk(self) -> None:
        """Write the chunk, in one piece, with the indexes of its messages."""
        if not self._parts:
            return
        data, ticks = b"".join(self._parts), self._ticks
        self._begin_chunk()
        times = [time for _, time, _ in ticks] or [0]
        start, end = min(times), max(times)
        index = Index(
            np.concatenate([frame.ids for frame, _, _ in ticks] or [NONE]),
            np.repeat(times, [len(frame.ids) for frame, _, _ in ticks] or [0]),
            np.concatenate([at + frame.places for frame, _, at in ticks] or [NONE]),
        )
        size = len(data)
        head = mcap.HEAD.pack(mcap.CHUNK, mcap.CHUNK_FIELDS + size)
        head += mcap.CHUNK_HEAD.pack(start, end, size, crc32(data)) + mcap.text("")
        head += size.to_bytes(8, "little")
        made = ChunkIndex(start, end, self.size, len(head) + size, size)
        self._write(b"".join((head, data, index.behind(made))))
        self.keep(made, index)

    def keep(self, made: ChunkIndex, index: Index) -> None:
        """Note a chunk that is in the file."""
        self.chunks.append(made)
        self._counts[index.ids] += index.counts

    # -- bytes ---------------------------------------------------------------------

    def _write(self, data: bytes) -> None:
        """Write all of it, or nothing. Raises OSError."""
        assert self._file is not None
        try:
            written = self._file.write(data)
            if written != len(data):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError:
            self._file.truncate(self.size)
            self._file.seek(self.size)
            raise
        self.size += len(data)
        self.crc = crc32(data, self.crc)

    def close(self) -> None:
        """Write the last chunk and the end. Raises OSError, and the file opens.

        If the disk is full, the end takes the room of the last chunks.
        """
        file, failed = self._file, None
        if file is None:
            return
        try:
            self.end_chunk()
        except OSError as error:
            failed = error
        try:
            while True:
                try:
                    self._write(self._ending())
                    break
                except OSError as error:
                    failed = failed or error
                    if not self.chunks:
                        raise
                    self._drop_chunk()
        finally:
            self._file = None
            file.close()
        if failed is not None:
            raise failed

    def _drop_chunk(self) -> None:
        """Take back the last chunk, to have room for the end."""
        assert self._file is not None
        last = self.chunks.pop()
        self._file.seek(last.at + last.length)
        for _, _, content in mcap.records(self._file.read(last.trailing)):
            number, size = mcap.Cursor(content).take("HI")
            self._counts[number] -= size // 16
        self.size, self.crc = last.at, 0
        self._file.truncate(self.size)
        self._file.seek(self.size)

    def _ending(self) -> bytes:
        """Return all that is behind the last chunk of a finished file."""
        data_end = mcap.record(mcap.DATA_END, self.crc.to_bytes(4, "little"))
        start = self.size + len(data_end)
        counts = self.counts.items()
        times = [one for one in self.chunks if one.places]
        statistics = struct.pack(
            "<QHIIIIQQ",
            sum(count for _, count in counts),
            len(self.types),
            len(self.channels),
            0,
            len(self.told),
            len(self.chunks),
            min((one.start for one in times), default=0),
            max((one.end for one in times), default=0),
        ) + mcap.text(b"".join(struct.pack("<HQ", *pair) for pair in counts))
        groups = {
            mcap.SCHEMA: map(mcap.schema, self.types.values()),
            mcap.CHANNEL: map(mcap.channel, self.channels.values()),
            mcap.STATISTICS: [mcap.record(mcap.STATISTICS, statistics)],
            mcap.CHUNK_INDEX: map(mcap.chunk_index, self.chunks),
            mcap.METADATA_INDEX: [
                mcap.record(
                    mcap.METADATA_INDEX, struct.pack("<QQ", at, size) + mcap.text(name)
                )
                for at, size, name in self.told
            ],
        }
        summary = offsets = b""
        for opcode, some in groups.items():
            if group := b"".join(some):
                place = mcap.OFFSET.pack(opcode, start + len(summary), len(group))
                offsets += mcap.record(mcap.SUMMARY_OFFSET, place)
                summary += group
        where = struct.pack("<QQ", start, start + len(summary))
        footer = mcap.HEAD.pack(mcap.FOOTER, mcap.FOOTER_FIELDS.size) + where
        check = crc32(summary + offsets + footer).to_bytes(4, "little")
        return data_end + summary + offsets + footer + check + mcap.MAGIC

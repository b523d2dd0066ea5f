"""Reading MCAP: what is in a file, and the messages of one channel.

Only the chunks that hold a channel are read, one after the other, so memory is that of
what is asked for, however long the file is.
"""

import json
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import IO, Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict import Schema
from rems_net.errors import ExperimentError, RemsError
from rems_net.recordings.manifest import Manifest, parsed
from rems_net.recordings.mcap import records as mcap
from rems_net.recordings.mcap.index import NONE, pairs
from rems_net.recordings.mcap.log import (
    CLOCK,
    EVENTS,
    RELEASED,
    STOPPED,
    read_log,
)
from rems_net.recordings.mcap.records import Channel, ChunkIndex
from rems_net.recordings.mcap.scan import check_magic, is_whole, opened, scan
from rems_net.recordings.mcap.writer import DERIVED, EXPERIMENT, SCHEMA

#: bytes. If the messages of a channel are further from each other, they are read one
#: by one, once the checksum of their chunk is known to fit.
FAR = 1 << 14
#: channel, tick, log time [ns] and content
Message = tuple[int, int, int, bytes]


class McapFile:
    """An MCAP file of a run.

    channels: those that can be read, by key (`robot/sim/state`).
    passed: topics of other channels, each with the reason why it is not read.
    Raises ExperimentError, in one sentence, for a file that cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.channels: dict[str, Channel] = {}
        self.schemas: dict[str, Schema] = {}
        self.passed: dict[str, str] = {}
        self.chunks: list[ChunkIndex] = []
        #: messages by key
        self.counts: dict[str, int] = {}
        self._told: list[tuple[int, int, str]] = []
        #: where chunks begin whose checksum fits
        self._sound: set[int] = set()
        #: the channel of events, which `events` reads
        self.log: Channel | None = None
        counts: dict[int, int] = {}
        with self.readable():
            #: whether the file has its end; a killed process leaves it without
            self.whole = is_whole(path)
            if self.whole:
                every, counts = self._summary()
            else:
                found = scan(path)
                every, counts = list(found.channels.values()), found.counts
                self.chunks, self._told = found.chunks, found.told
            for one in sorted(every, key=lambda one: one.topic):
                self._take(one, counts)

    @contextmanager
    def readable(self) -> Iterator[None]:
        """Raise ExperimentError for anything wrong with the file."""
        try:
            yield
        except FileNotFoundError:
            raise ExperimentError(f"there is no file {self.path}. (R0805)") from None
        except OSError as error:
            raise ExperimentError(
                f"cannot read {self.path.name}: {error.strerror}. (R0805)"
            ) from None
        except (ValueError, IndexError, struct.error) as error:
            if isinstance(error, ExperimentError):
                raise
            raise ExperimentError(
                f"{self.path.name} is damaged: {error}. Copy it once more, "
                f"or type: rems repair {self.path} (R0805)"
            ) from None

    def _summary(self) -> tuple[list[Channel], dict[int, int]]:
        """Read the summary at the end of the file. Raises ValueError, OSError."""
        channels: list[Channel] = []
        counts: dict[int, int] = {}
        with self.path.open("rb") as file:
            check_magic(file, self.path.name)
            size = file.seek(0, 2)
            file.seek(-mcap.END + mcap.HEAD.size, 2)
            start, _, check = mcap.Cursor(file.read(mcap.END)).take("QQI")
            if not 0 < start < size:
                raise ExperimentError(
                    f"{self.path.name} has no summary, which is written at the end "
                    f"of a run. Type: rems repair {self.path} "
                    "(R0805)"
                )
            if size - start > mcap.LONGEST:
                raise ValueError(f"its summary has {size - start} bytes")
            file.seek(start)
            data = file.read(size - start - len(mcap.MAGIC) - 4)
        if check and crc32(data) != check:
            raise ValueError("the checksum of its summary does not fit")
        for opcode, _, content in mcap.records(data):
            if opcode == mcap.CHANNEL:
                channels.append(mcap.read_channel(content))
            elif opcode == mcap.CHUNK_INDEX:
                self.chunks.append(mcap.read_chunk_index(content))
            elif opcode == mcap.STATISTICS:
                cursor = mcap.Cursor(content)
                cursor.take("QHIIIIQQ")
                counts = dict(struct.iter_unpack("<HQ", cursor.bytes()))
            elif opcode == mcap.METADATA_INDEX:
                cursor = mcap.Cursor(content)
                at, length = cursor.take("QQ")
                self._told.append((at, length, cursor.text()))
        return channels, counts

    def _take(self, one: Channel, counts: dict[int, int]) -> None:
        """Note a channel, if it can be read here."""
        key = one.topic.removeprefix("/")
        if key == EVENTS:
            self.log = one
        if DERIVED in one.metadata:
            return  # for viewers: what it was made of is there
        if one.encoding != "cdr":
            self.passed[one.topic] = f"its messages are {one.encoding!r}, not CDR"
        elif SCHEMA not in one.metadata:
            self.passed[one.topic] = "it has no schema of rems"
        else:
            try:
                self.schemas[key] = Schema.from_wire(
                    bytes.fromhex(one.metadata[SCHEMA])
                )
            except (ValueError, RemsError) as error:
                self.passed[one.topic] = f"its schema cannot be read: {error}"
            else:
                self.channels[key] = one
                self.counts[key] = counts.get(one.id, 0)

    # -- what was run ------------------------------------------------------------

    def about(self) -> dict[str, Any]:
        """Return what the file has of its experiment: name, dt, seed, agents ..."""
        with self.readable(), self.path.open("rb") as file:
            for at, length, name in self._told:
                if name == EXPERIMENT:
                    file.seek(at)
                    cursor = mcap.Cursor(file.read(length))
                    cursor.take("BQ")
                    cursor.text()
                    return {k: json.loads(v) for k, v in cursor.table().items()}
        return {}

    @cached_property
    def told(self) -> Manifest:
        """The same as of a run.json; an empty one if it is not there."""
        return parsed(self.about()) or Manifest()

    @property
    def end(self) -> float:
        """Time of the last value, s; 0 if there is none."""
        return max((one.end for one in self.chunks), default=0) / 1e9

    @cached_property
    def last(self) -> int:
        """The last tick; 0 if the length of a tick is not known."""
        return round(self.end / self.told.dt) if self.told.dt else 0

    def ordered(self, key: str) -> list[str]:
        """Return the paths of a port in the order of its definition.

        A message has its fields in the order of their names. In a file without
        orders, a pose comes first.
        """
        schema = self.schemas[key]
        known = self.told.fields.get(schema.digest, self._usual)
        order = {path: i for i, path in enumerate(known)}
        return sorted(schema.paths, key=lambda p: (order.get(p, len(order)), p))

    @cached_property
    def _usual(self) -> tuple[str, ...]:
        return () if "fields" in self.about() else ("x", "y", "heading")

    # -- messages ----------------------------------------------------------------

    def events(self) -> Iterator[tuple[int, str, str]]:
        """Yield the time [ns], the key of the agent and the sentence of each event."""
        if self.log is not None:
            with self.readable():
                for times, messages in self._messages(self.log.id):
                    for time, message in zip(times, messages, strict=True):
                        _, key, text = read_log(message)
                        yield time, key, text

    def holds(self) -> Iterator[tuple[int, bool]]:
        """Yield the tick of each STOP, with True, and of each release, with False."""
        for time, key, text in self.events() if self.told.dt else ():
            if key == CLOCK and text in (STOPPED, RELEASED):
                yield round(time / 1e9 / self.told.dt), text == STOPPED

    def messages(self, key: str) -> Iterator[tuple[list[int], list[bytes]]]:
        """Return log times [ns] and messages of a channel, chunk by chunk."""
        return self._messages(self.channels[key].id)

    def _messages(self, number: int) -> Iterator[tuple[list[int], list[bytes]]]:
        with self.readable(), self.path.open("rb") as file:
            for chunk in self.chunks:
                found = [*self._some(file, chunk, number)]
                if found:
                    _, _, times, messages = zip(*found, strict=True)
                    yield [*times], [*messages]

    def times(self, key: str) -> NDArray[np.int64]:
        """Return the log times (n,) [ns] of a channel; only indexes are read."""
        number = self.channels[key].id
        with self.readable(), self.path.open("rb") as file:
            found = [pairs(file, chunk, number)[:, 0] for chunk in self.chunks]
        return np.concatenate([NONE, *found])

    def ticks(self) -> Iterator[tuple[int, dict[str, bytes]]]:
        """Yield each tick's number and its messages by key, in the file's order."""
        return ((n, found) for n, _, found in self.moments())

    def moments(self, *keys: str) -> Iterator[tuple[int, int, dict[str, bytes]]]:
        """Yield the same with the log time [ns] between them; keys: of these only."""
        known = {one.id: key for key, one in self.channels.items()}
        wanted = [self.channels[key].id for key in keys]
        with self.readable(), self.path.open("rb") as file:
            for chunk in self.chunks:
                n, time, found = -1, 0, dict[str, bytes]()
                every = self._some(file, chunk, *wanted) if keys else None
                for channel, tick, log, message in every or self._all(file, chunk):
                    if tick != n and found:
                        yield n, time, found
                        found = {}
                    n, time = tick, log
                    if channel in known:
                        found[known[channel]] = message
                if found:
                    yield n, time, found

    def _all(self, file: IO[bytes], chunk: ChunkIndex) -> Iterator[Message]:
        """Yield the messages of a chunk, in its order."""
        data = self._opened(file, chunk)
        for code, at, content in mcap.records(data):
            if code == mcap.MESSAGE:
                _, _, channel, tick, log, _ = mcap.MESSAGE_HEAD.unpack_from(data, at)
                yield channel, tick, log, content[mcap.MESSAGE_FIELDS :]

    def _some(
        self, file: IO[bytes], chunk: ChunkIndex, *channels: int
    ) -> Iterator[Message]:
        """Yield those of some channels, by their times. Raises ValueError."""
        index = np.concatenate([pairs(file, chunk, one) for one in channels])
        places = index[np.lexsort(index.T[::-1])][:, 1].tolist()
        if not places:
            return
        apart = chunk.at in self._sound and chunk.size > FAR * len(places)
        source = file if apart else BytesIO(self._opened(file, chunk))
        begin = chunk.at + mcap.HEAD.size + mcap.CHUNK_FIELDS if apart else 0
        head = mcap.MESSAGE_HEAD
        for at in places:
            source.seek(begin + at)
            code, size, channel, tick, log, _ = head.unpack(source.read(head.size))
            size -= mcap.MESSAGE_FIELDS
            if code != mcap.MESSAGE or channel not in channels or size < 0:
                raise ValueError("a message is not at the place in its index")
            yield channel, tick, log, source.read(min(size, mcap.LONGEST))

    def _opened(self, file: IO[bytes], chunk: ChunkIndex) -> bytes:
        """Return what is in a chunk."""
        file.seek(chunk.at)
        if chunk.length > mcap.LONGEST:
            raise ValueError(f"a chunk has {chunk.length} bytes")
        record = file.read(chunk.length)
        opcode, size = mcap.HEAD.unpack_from(record)
        begin = mcap.HEAD.size
        if opcode != mcap.CHUNK or begin + size != chunk.length:
            raise ValueError("a chunk is not where the index has it")
        data = opened(record[begin:], self.path.name)[0]
        self._sound.add(chunk.at)
        return data

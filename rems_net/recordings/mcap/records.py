"""The records of an MCAP file, as bytes: what each begins with, and what is in it.

The format is that of https://mcap.dev/spec. A record is an opcode, a length of eight
bytes, and its fields, little-endian.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX = range(1, 8)
CHUNK_INDEX, STATISTICS, METADATA = 0x08, 0x0B, 0x0C
METADATA_INDEX, SUMMARY_OFFSET, DATA_END = 0x0D, 0x0E, 0x0F
#: opcode and length, in front of each record
HEAD = struct.Struct("<BQ")
#: a message with its head: channel, sequence, log time and publish time [ns]
MESSAGE_HEAD = struct.Struct("<BQHIQQ")
#: bytes of a message before its data, without the head
MESSAGE_FIELDS = MESSAGE_HEAD.size - HEAD.size
#: an opcode, a place and a length
OFFSET = struct.Struct("<BQQ")
#: start, end and size of the messages in a chunk, and their checksum
CHUNK_HEAD = struct.Struct("<QQQI")
#: bytes of a chunk before its messages: no compression
CHUNK_FIELDS = CHUNK_HEAD.size + 4 + 8
#: where the summary and its offsets begin, and the summary's checksum
FOOTER_FIELDS = struct.Struct("<QQI")
#: bytes at the end of every finished file: its footer, and the magic again
END = HEAD.size + FOOTER_FIELDS.size + len(MAGIC)
#: bytes of the longest summary, and of the longest chunk, that is read
LONGEST = 1 << 30


class Schema(NamedTuple):
    """The type of a channel's messages."""

    id: int
    name: str
    encoding: str
    data: bytes


class Channel(NamedTuple):
    """A stream of messages of one type; the topic is the key of a port."""

    id: int
    schema: int
    topic: str
    encoding: str
    metadata: Mapping[str, str]


@dataclass
class ChunkIndex:
    """Where a chunk is.

    start, end: log times [ns].  at: of the chunk in the file.  length: of its record.
    size: of what is in it.  places: of each channel, where its message index is; as
    bytes, since a run of an hour with a thousand robots has millions of them.
    """

    start: int
    end: int
    at: int
    length: int
    size: int
    compression: str = ""
    places: bytes = b""
    #: bytes of the message indexes behind it
    trailing: int = 0


def record(opcode: int, content: bytes) -> bytes:
    """Return a whole record."""
    return HEAD.pack(opcode, len(content)) + content


def text(words: str | bytes) -> bytes:
    """Return text, or bytes, with its length in front."""
    data = words.encode() if isinstance(words, str) else words
    return len(data).to_bytes(4, "little") + data


def table(entries: Mapping[str, str]) -> bytes:
    """Return a map of texts."""
    return text(b"".join(text(k) + text(v) for k, v in entries.items()))


def schema(one: Schema) -> bytes:
    """Return the record of a schema."""
    content = one.id.to_bytes(2, "little") + text(one.name) + text(one.encoding)
    return record(SCHEMA, content + text(one.data))


def channel(one: Channel) -> bytes:
    """Return the record of a channel."""
    content = struct.pack("<HH", one.id, one.schema) + text(one.topic)
    return record(CHANNEL, content + text(one.encoding) + table(one.metadata))


def metadata(name: str, entries: Mapping[str, str]) -> bytes:
    """Return a record of named texts."""
    return record(METADATA, text(name) + table(entries))


def chunk_index(one: ChunkIndex) -> bytes:
    """Return the record of a chunk's index."""
    content = struct.pack("<QQQQ", one.start, one.end, one.at, one.length)
    content += text(one.places) + one.trailing.to_bytes(8, "little")
    content += text(one.compression) + struct.pack("<QQ", one.size, one.size)
    return record(CHUNK_INDEX, content)


# -- reading ----------------------------------------------------------------------


class Cursor:
    """Takes fields from the content of a record. Raises ValueError at its end."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def take(self, form: str) -> tuple[int, ...]:
        """Return whole numbers, by a format of `struct`."""
        layout = struct.Struct(f"<{form}")
        if self.at + layout.size > len(self.data):
            raise ValueError("a record ends too early")
        found = layout.unpack_from(self.data, self.at)
        self.at += layout.size
        return found

    def bytes(self) -> bytes:
        """Return bytes that have their length in front."""
        (size,) = self.take("I")
        if self.at + size > len(self.data):
            raise ValueError("a record ends too early")
        self.at += size
        return self.data[self.at - size : self.at]

    def text(self) -> str:
        """Return text."""
        return self.bytes().decode()

    def table(self) -> dict[str, str]:
        """Return a map of texts."""
        inner, found = Cursor(self.bytes()), {}
        while inner.at < len(inner.data):
            key = inner.text()
            found[key] = inner.text()
        return found


def read_schema(content: bytes) -> Schema:
    """Return a schema from its record."""
    cursor = Cursor(content)
    return Schema(cursor.take("H")[0], cursor.text(), cursor.text(), cursor.bytes())


def read_channel(content: bytes) -> Channel:
    """Return a channel from its record."""
    cursor = Cursor(content)
    number, its_schema = cursor.take("HH")
    return Channel(number, its_schema, cursor.text(), cursor.text(), cursor.table())


def read_chunk_index(content: bytes) -> ChunkIndex:
    """Return the index of a chunk from its record."""
    cursor = Cursor(content)
    start, end, at, length = cursor.take("QQQQ")
    places = cursor.bytes()
    (trailing,) = cursor.take("Q")
    compression = cursor.text()
    _, size = cursor.take("QQ")
    places = places[: len(places) - len(places) % 10]
    return ChunkIndex(start, end, at, length, size, compression, places, trailing)


def records(data: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Yield opcode, place and content of the whole records."""
    at = 0
    while at + HEAD.size <= len(data):
        opcode, size = HEAD.unpack_from(data, at)
        if at + HEAD.size + size > len(data):
            return
        begin = at + HEAD.size
        yield opcode, at, data[begin : begin + size]
        at = begin + size

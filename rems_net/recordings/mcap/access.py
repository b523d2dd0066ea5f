"""Random access: messages of a channel at a time, without the rest of the file."""

import struct
from collections import OrderedDict
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.mcap import records as mcap
from rems_net.recordings.mcap.reader import LONGEST, McapFile
from rems_net.recordings.mcap.records import Channel
from rems_net.recordings.mcap.scan import check_compression

#: times [ns] and places in the file of some messages (n, 2)
Places = NDArray[np.int64]
#: bytes of message indexes that stay in memory
KEPT = 1 << 24
#: a message index, before its pairs of time and place
_INDEX = struct.Struct("<BQHI")
#: in the index of a chunk: a channel, and where its message index is
_PLACE = np.dtype([("id", "<u2"), ("at", "<u8")])
_NONE: Places = np.zeros((0, 2), np.int64)


class Message(NamedTuple):
    """One message. n: number of its tick.  time: ns."""

    n: int
    time: int
    data: bytes


class Access:
    """Messages of an MCAP file, by channel and time. Any thread may call it.

    Of the file, only message indexes and the messages that are asked for are read. The
    memory is that of its summary and KEPT, however long it is.
    Raises ExperimentError for a file that cannot be read.
    """

    def __init__(self, file: McapFile) -> None:
        self._file = file
        self._chunks = sorted(file.chunks, key=lambda one: one.start)
        for one in self._chunks:
            check_compression(one.compression, file.path.name)
        self._starts = np.array([one.start for one in self._chunks], np.int64)
        ids = [np.frombuffer(one.places, _PLACE)["id"] for one in self._chunks]
        every = np.concatenate([np.zeros(0, "<u2"), *ids])
        numbers = np.repeat(np.arange(len(ids), dtype=np.int32), [*map(len, ids)])
        order = np.argsort(every, kind="stable")
        channels, first = np.unique(every[order], return_index=True)
        parts = np.split(numbers[order], first[1:])
        #: by channel, the numbers of the chunks that hold it, rising
        self._where = dict(zip(channels.tolist(), parts, strict=bool(len(channels))))
        self._kept: OrderedDict[tuple[int, int], Places] = OrderedDict()
        self._size = 0
        self._lock = Lock()
        with file.readable():
            self._stream = file.path.open("rb")

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    def places(
        self, channel: Channel, until: int, after: int = -1, most: int = 0
    ) -> Places:
        """Return where the messages of a channel are with after < time <= until [ns].

        most: at most the newest so many; 0 for all.
        """
        with self._lock, self._file.readable():
            return self._places(channel, until, after, most)

    def _places(self, channel: Channel, until: int, after: int, most: int) -> Places:
        numbers = self._where.get(channel.id, _NONE[:, 0])
        begun = np.searchsorted(self._starts, until, side="right")
        found, count = [_NONE], 0
        for number in numbers[: np.searchsorted(numbers, begun)][::-1].tolist():
            if self._chunks[number].end <= after or (most and count >= most):
                break
            index = self._index(number, channel.id)
            low, high = np.searchsorted(index[:, 0], (after, until), side="right")
            found.append(index[low:high])
            count += int(high - low)
        return np.concatenate(found[::-1])[-most:]

    def read(self, channel: Channel, places: Places) -> list[Message]:
        """Return the messages at these places."""
        found = []
        head, stream = mcap.MESSAGE_HEAD, self._stream
        with self._lock, self._file.readable():
            for at in places[:, 1].tolist():
                stream.seek(at)
                code, length, number, n, time, _ = head.unpack(stream.read(head.size))
                size = length - mcap.MESSAGE_FIELDS
                right = code == mcap.MESSAGE and number == channel.id
                if not right or not 0 <= size <= LONGEST:
                    raise ValueError("a message is not at the place in its index")
                found.append(Message(n, time, stream.read(size)))
        return found

    def _index(self, number: int, channel: int) -> Places:
        """Return where all messages of a channel are in a chunk."""
        known = self._kept.get((number, channel))
        if known is not None:
            self._kept.move_to_end((number, channel))
            return known
        made = self._kept[number, channel] = self._read_index(number, channel)
        self._size += made.nbytes
        while self._size > KEPT and len(self._kept) > 1:
            self._size -= self._kept.popitem(last=False)[1].nbytes
        return made

    def _read_index(self, number: int, channel: int) -> Places:
        chunk = self._chunks[number]
        where = np.frombuffer(chunk.places, _PLACE)
        self._stream.seek(int(where["at"][where["id"] == channel][0]))
        begin = chunk.at + mcap.HEAD.size + mcap.CHUNK_FIELDS
        head = self._stream.read(_INDEX.size)
        if len(head) == _INDEX.size:
            code, _, one, size = _INDEX.unpack(head)
            data = self._stream.read(min(size, LONGEST))
            if (code, one, len(data)) == (mcap.MESSAGE_INDEX, channel, size):
                pairs: Places = np.frombuffer(data, "<i8", size // 16 * 2)
                made: Places = pairs.reshape(-1, 2) + np.array([0, begin])
                return made
        # A killed process has left the chunk without its indexes.
        self._stream.seek(begin)
        data = self._stream.read(chunk.size)
        found = [
            (mcap.MESSAGE_HEAD.unpack_from(data, at)[4], begin + at)
            for code, at, content in mcap.records(data)
            if code == mcap.MESSAGE and content[:2] == channel.to_bytes(2, "little")
        ]
        return np.array(found, np.int64).reshape(-1, 2)

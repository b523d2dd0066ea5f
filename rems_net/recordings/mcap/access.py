"""Random access: messages of a channel at a time, without the rest of the file."""

from collections import OrderedDict
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.mcap import records as mcap
from rems_net.recordings.mcap.index import PLACE, pairs
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.mcap.records import Channel
from rems_net.recordings.mcap.scan import check_compression

#: times [ns] and places in the file of some messages (n, 2)
Places = NDArray[np.int64]
#: bytes of message indexes that stay in memory
KEPT = 1 << 24
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
        ids = [np.frombuffer(one.places, PLACE)["id"] for one in self._chunks]
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
                if not right or not 0 <= size <= mcap.LONGEST:
                    raise ValueError("a message is not at the place in its index")
                found.append(Message(n, time, stream.read(size)))
        return found

    def _index(self, number: int, channel: int) -> Places:
        """Return where all messages of a channel are in a chunk."""
        known = self._kept.get((number, channel))
        if known is not None:
            self._kept.move_to_end((number, channel))
            return known
        chunk = self._chunks[number]
        begin = chunk.at + mcap.HEAD.size + mcap.CHUNK_FIELDS
        made: Places = pairs(self._stream, chunk, channel) + np.array([0, begin])
        self._kept[number, channel] = made
        self._size += made.nbytes
        while self._size > KEPT and len(self._kept) > 1:
            self._size -= self._kept.popitem(last=False)[1].nbytes
        return made

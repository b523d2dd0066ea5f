"""Where messages are in a chunk, computed for all of them at once, and read back."""

import struct
from typing import IO

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.mcap import records as mcap
from rems_net.recordings.mcap.records import ChunkIndex

Whole = NDArray[np.int64]
NONE = np.zeros(0, np.int64)
#: a message index, before its pairs of time and place
_INDEX = [("opcode", "u1"), ("length", "<u8"), ("id", "<u2"), ("size", "<u4")]
_INDEX_HEAD = struct.Struct("<BQHI")
#: in the index of a chunk: a channel, and where its message index is
PLACE = np.dtype([("id", "<u2"), ("at", "<u8")])


class Index:
    """Where the messages of a chunk are: ids of their channels, times [ns], places."""

    def __init__(self, ids: Whole, times: Whole, places: Whole) -> None:
        order = np.argsort(ids, kind="stable")
        self._pairs = np.stack((times, places), axis=1)[order]
        #: each channel once, and how many messages it has
        self.ids, self._first, self.counts = np.unique(
            ids[order], return_index=True, return_counts=True
        )

    def behind(self, chunk: ChunkIndex) -> bytes:
        """Return the indexes behind a chunk, and note in it where they are.

        Those of channels with equally many messages are made at once.
        """
        at, parts, places = chunk.at + chunk.length, [], []
        for count in np.unique(self.counts).tolist():
            these = self.counts == count
            pairs = ("pairs", "<u8", (count, 2))
            rows = np.zeros(these.sum(), [*_INDEX, pairs])
            rows["opcode"], rows["id"] = mcap.MESSAGE_INDEX, self.ids[these]
            rows["length"], rows["size"] = 6 + 16 * count, 16 * count
            which = self._first[these][:, None] + np.arange(count)
            rows["pairs"] = self._pairs[which]
            where = np.zeros(len(rows), PLACE)
            where["id"] = rows["id"]
            where["at"] = at + rows.itemsize * np.arange(len(rows))
            parts.append(rows.tobytes())
            places.append(where.tobytes())
            at += rows.nbytes
        chunk.places = b"".join(places)
        chunk.trailing = at - chunk.at - chunk.length
        return b"".join(parts)


def pairs(file: IO[bytes], chunk: ChunkIndex, channel: int) -> Whole:
    """Return the times [ns] of a channel's messages in a chunk and their places (n, 2).

    Raises ValueError for a damaged file.
    """
    where = np.frombuffer(chunk.places, PLACE)
    found = where["at"][where["id"] == channel].tolist()
    if not found:
        return NONE.reshape(-1, 2)
    file.seek(found[0])
    head = file.read(_INDEX_HEAD.size)
    if len(head) == _INDEX_HEAD.size:
        code, _, one, size = _INDEX_HEAD.unpack(head)
        data = file.read(min(size, mcap.LONGEST))
        if (code, one, len(data)) == (mcap.MESSAGE_INDEX, channel, size):
            return np.frombuffer(data, "<i8", size // 16 * 2).reshape(-1, 2)
    # A killed process has left the chunk without its indexes.
    file.seek(chunk.at + mcap.HEAD.size + mcap.CHUNK_FIELDS)
    data = file.read(chunk.size)
    there = [
        (mcap.MESSAGE_HEAD.unpack_from(data, at)[4], at)
        for code, at, content in mcap.records(data)
        if code == mcap.MESSAGE and content[:2] == channel.to_bytes(2, "little")
    ]
    return np.array(there, np.int64).reshape(-1, 2)

"""Where messages are in a chunk, computed for all of them at once."""

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.mcap import records as mcap
from rems_net.recordings.mcap.records import ChunkIndex

Whole = NDArray[np.int64]
NONE = np.zeros(0, np.int64)
#: a message index, before its pairs of time and place
_INDEX = [("opcode", "u1"), ("length", "<u8"), ("id", "<u2"), ("size", "<u4")]
#: where one is, in the index of a chunk
_PLACE = np.dtype([("id", "<u2"), ("at", "<u8")])


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
            where = np.zeros(len(rows), _PLACE)
            where["id"] = rows["id"]
            where["at"] = at + rows.itemsize * np.arange(len(rows))
            parts.append(rows.tobytes())
            places.append(where.tobytes())
            at += rows.nbytes
        chunk.places = b"".join(places)
        chunk.trailing = at - chunk.at - chunk.length
        return b"".join(parts)

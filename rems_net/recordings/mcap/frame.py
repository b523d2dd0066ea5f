"""Frame: what the messages of a tick have in common with those of the next."""

import struct
from collections.abc import Mapping

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from rems_net.defdict import Batch
from rems_net.recordings.mcap import records as mcap
from rems_net.recordings.mcap.index import Whole
from rems_net.recordings.mcap.records import Channel

Bytes = NDArray[np.uint8]
_HEAD = struct.Struct("<BQH")
#: sequence, log time and publish time of a message, behind its head
_STAMP = struct.Struct("<IQQ")


class Frame:
    """Their keys, sorted by channel, their sizes, and what each begins with.

    Of most agents these are the same at each tick.
    """

    def __init__(self, channels: Mapping[str, Channel], messages: Batch) -> None:
        self._there = frozenset(messages)
        self._alone = sorted(messages, key=lambda key: channels[key].id)
        self._sizes = [len(messages[key]) for key in self._alone]
        sizes = dict(zip(self._alone, self._sizes, strict=True))
        self._crowds = [(some.keys, some.data.shape[1]) for some in messages.rows]
        for keys, size in self._crowds:
            sizes.update((key, size) for key in keys)
        every = sorted(sizes, key=lambda key: channels[key].id)
        lengths = np.array([sizes[key] for key in every], np.int64)
        self.ids = np.array([channels[key].id for key in every], np.int64)
        ends = (lengths + mcap.MESSAGE_HEAD.size).cumsum()
        #: where each begins, counted from the first
        self.places: Whole = ends - lengths - mcap.MESSAGE_HEAD.size
        self._heads = [
            _HEAD.pack(mcap.MESSAGE, mcap.MESSAGE_FIELDS + sizes[key], number)
            for key, number in zip(every, self.ids.tolist(), strict=True)
        ]
        if self._crowds:
            self._begin_rows(every, int(ends[-1]))

    def _begin_rows(self, every: list[str], length: int) -> None:
        places = self.places.tolist()
        self._empty = bytearray(length)
        for place, head in zip(places, self._heads, strict=True):
            self._empty[place : place + _HEAD.size] = head
        where = dict(zip(every, places, strict=True))
        self._rows = [
            np.array([where[key] for key in keys], np.int64) for keys, _ in self._crowds
        ]
        before = mcap.MESSAGE_HEAD.size
        self._places = [
            slice(where[key] + before, where[key] + before + size)
            for key, size in zip(self._alone, self._sizes, strict=True)
        ]

    def fits(self, messages: Batch) -> bool:
        """Return whether the messages of another tick have the same form."""
        return (
            messages.keys() == self._there
            and [len(messages[key]) for key in self._alone] == self._sizes
            and [(some.keys, some.data.shape[1]) for some in messages.rows]
            == self._crowds
        )

    def filled(self, n: int, time: int, messages: Batch) -> bytes | bytearray:
        """Return the records of the messages of tick n, at a time [ns]."""
        stamp = _STAMP.pack(n & 0xFFFFFFFF, time, time)
        if self._crowds:
            return self._filled_rows(stamp, messages)
        parts = [stamp] * (3 * len(self._alone))
        parts[::3] = self._heads
        parts[2::3] = [messages[key] for key in self._alone]
        return b"".join(parts)

    def _filled_rows(self, stamp: bytes, messages: Batch) -> bytearray:
        made = bytearray(self._empty)
        stamps = np.frombuffer(stamp, np.uint8)
        whole = np.frombuffer(made, np.uint8)
        for places, rows in zip(self._rows, messages.rows, strict=True):
            _put(whole, places + _HEAD.size, stamps)
            _put(whole, places + mcap.MESSAGE_HEAD.size, rows.data)
        for key, place in zip(self._alone, self._places, strict=True):
            made[place.start - _STAMP.size : place.stop] = stamp + messages[key]
        return made


def _put(whole: Bytes, places: Whole, data: Bytes) -> None:
    """Write rows of bytes, or one for all, to places of an array."""
    size, steps = data.shape[-1], np.unique(np.diff(places))
    if len(steps) == 1 and steps[0] >= size:  # robots that are alike
        shape, strides = (len(places), size), (int(steps[0]), 1)
        as_strided(whole[places[0] :], shape, strides)[:] = data
    else:
        whole[places[:, None] + np.arange(size)] = data

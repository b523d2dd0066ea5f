"""Messages of many values of one schema at once, as the rows of one array.

A crowd has thousands of values a tick. Python code for each of them costs more than
all that is done with their bytes.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import chain
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict.wire.cdr import HEADER
from rems_net.defdict.wire.codec import payload_parts

Bytes = NDArray[np.uint8]
_leaves = attrgetter("_leaves")


class Rows(NamedTuple):
    """Messages of equal length. keys (n,): of their ports; data (n, length): bytes."""

    keys: tuple[str, ...]
    data: Bytes


class Batch(dict[str, bytes]):
    """Messages of a tick by port key; those of crowds may be in `rows` instead."""

    def __init__(self, messages: Mapping[str, bytes] | None = None) -> None:
        super().__init__(messages or {})
        self.rows: list[Rows] = []

    def add(self, other: "Batch") -> None:
        """Add the messages of another one."""
        self |= other
        self.rows += other.rows

    def clear(self) -> None:
        """Remove all messages."""
        super().clear()
        self.rows.clear()

    def spread(self) -> None:
        """Put the messages of all rows by their keys, too."""
        for keys, data in self.rows:
            self.update(zip(keys, map(bytes, data), strict=True))
        self.rows.clear()

    def table(self, keys: tuple[str, ...], layout: np.dtype[Any]) -> NDArray[Any]:
        """Return the messages of these keys (n,). Raises KeyError if one is missing."""
        for some in self.rows:
            if some.keys == keys:
                return some.data.view(layout)[:, 0]
        self.spread()
        return np.frombuffer(b"".join([self[key] for key in keys]), layout)


class RowCodec:
    """Makes rows of the values of one schema, all of whose fields are floats."""

    def __init__(self, schema: Any) -> None:
        paths = schema.paths
        #: the fields in the order of a message, which is that of their paths
        self._order = np.array(sorted(range(len(paths)), key=paths.__getitem__))
        template, places = b"", []
        for constant, _ in payload_parts(schema):
            template += constant
            places.append(len(template))
            template += bytes(8)
        self._length, starts = len(template), np.array(places)
        # A payload has its numbers the other way round than a message.
        numbers = starts[self._order][:, None] + np.arange(7, -1, -1)
        self._numbers = numbers.ravel()
        fixed = np.ones(len(template), bool)
        fixed[self._numbers] = False
        self._fixed = np.flatnonzero(fixed)
        self._template = np.frombuffer(template, np.uint8)[self._fixed]
        limits = np.array([one.limits for one in schema.fields], np.float64)
        self._low, self._high = limits[self._order].T

    def of_values(self, values: Iterable[Any]) -> Bytes:
        """Return the messages (n, length) of DefDicts of the schema."""
        every = chain.from_iterable(map(_leaves, values))
        numbers = np.fromiter(every, "<f8").reshape(-1, len(self._order))
        return _headed(numbers[:, self._order])

    def of_payloads(self, payloads: Sequence[bytes]) -> Bytes | None:
        """Return the messages (n, length) of payloads; None if one is unusual.

        Such a payload may be right all the same: transcode them one by one.
        """
        if set(map(len, payloads)) != {self._length}:
            return None
        raw = np.frombuffer(b"".join(payloads), np.uint8).reshape(-1, self._length)
        if (raw[:, self._fixed] != self._template).any():
            return None
        numbers = raw.take(self._numbers, axis=1).view("<f8")
        if not ((numbers >= self._low) & (numbers <= self._high)).all():
            return None
        return _headed(numbers)


def _headed(numbers: NDArray[np.float64]) -> Bytes:
    data = np.empty((len(numbers), len(HEADER) + 8 * numbers.shape[1]), np.uint8)
    data[:, : len(HEADER)] = np.frombuffer(HEADER, np.uint8)
    data[:, len(HEADER) :] = np.ascontiguousarray(numbers).view(np.uint8)
    return data


@lru_cache(maxsize=2048)
def row_codec(schema: Any) -> RowCodec | None:
    """Return the codec of a schema; None if it has other fields than floats."""
    floats = [one.dtype == "float" and not one.shape for one in schema.fields]
    return RowCodec(schema) if floats and all(floats) else None

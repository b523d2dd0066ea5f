"""The columns of one agent in an MCAP file, as those of a CSV file."""

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict import Field, Schema, cdr
from rems_net.recordings.csv_file import Column, heading
from rems_net.recordings.export.lines import elements, order, unit_of
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.mcap.span import Span

Values = NDArray[Any]
#: of all columns the first
TIME = Column(0, heading("time", "s"), "time", "s")


def agents_of(file: McapFile) -> list[str]:
    """Return the keys of the agents that have written something."""
    return sorted({_agent(key) for key in file.channels})


class AgentColumns(Mapping[Column, Values]):
    """Columns (n,) of an agent, or of some of its ports; the first is the time.

    They are those of a CSV file: a row for each tick, numbers as floats, bytes as
    hexadecimal digits, without pictures. If a port was not written at a tick, its
    value of before holds; before the first, the initial one. A column is read when
    it is asked for, and with it only the chunks that hold its port.
    """

    def __init__(self, file: McapFile, agent: str, *only: str) -> None:
        self._file = file
        keys = [f"{agent}/{port}" for port in only] or file.channels
        keys = [key for key in keys if key in file.channels and _agent(key) == agent]
        ports = sorted(keys, key=lambda key: order(key.rpartition("/")[2]))
        self.seconds, self._times = _rows(file, agent, ports)
        #: by column: the key of its port, and its name there
        self._where: dict[Column, tuple[str, str]] = {TIME: ("", "")}
        for key in ports:
            port = key.rpartition("/")[2]
            for name, one in _names(file, key):
                about = f"{port}/{name}", unit_of(one)
                column = Column(len(self._where), heading(*about), *about)
                self._where[column] = key, name
        self._read: dict[Column, Values] = {TIME: self.seconds}

    def __iter__(self) -> Iterator[Column]:
        return iter(self._where)

    def __len__(self) -> int:
        return len(self._where)

    def __getitem__(self, column: Column) -> Values:
        if column not in self._read:
            key, name = self._where[column]
            schema = self._file.schemas[key]
            before = self._file.told.initial(key, schema)
            default = _parsed(schema, [cdr(schema).encode(before)], name)[name]
            times, blocks = [np.zeros(0, np.int64)], [default]
            for some, found in read_blocks(self._file, key, name):
                times.append(np.array(some, np.int64))
                blocks.append(found[name])
            place = np.searchsorted(np.concatenate(times), self._times, side="right")
            self._read[column] = np.concatenate(blocks)[place]
        return self._read[column]


def _rows(
    file: McapFile, agent: str, keys: Sequence[str]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the times of the rows (n,), in s and in ns.

    Without a known length of ticks, they are the times at which it has written.
    """
    every = np.unique(np.concatenate([file.times(key) for key in keys]))
    if not file.told.dt or not len(every):
        return every / 1e9, every
    p, q = Fraction(repr(file.told.dt)).as_integer_ratio()
    seconds = Span(file, agent).rows(np.rint(every / 1e9 * q / p)) * float(p) / q
    return seconds, np.rint(seconds * 1e9).astype(np.int64)


def _agent(key: str) -> str:
    return key.rpartition("/")[0]


def read_blocks(
    file: McapFile, key: str, only: str = ""
) -> Iterator[tuple[list[int], dict[str, Values]]]:
    """Yield times [ns] and columns of a port, or one of them, chunk by chunk."""
    for times, messages in file.messages(key):
        with file.readable():
            yield times, _parsed(file.schemas[key], messages, only)


def _parsed(
    schema: Schema, messages: Sequence[bytes], only: str = ""
) -> dict[str, Values]:
    """Return columns of messages. Raises ValueError for one that does not fit."""
    codec, wanted = cdr(schema), only.partition("[")[0]
    every = [(path, one) for path, one in schema.rows() if wanted in ("", path)]
    if (layout := codec.layout) is not None:
        if any(len(one) != layout.itemsize for one in messages):
            raise ValueError("a message does not have the length of its schema")
        rows = np.frombuffer(b"".join(messages), layout)
        return dict(_split(every, [rows[path] for path, _ in every], only))
    places = [schema.paths.index(path) for path, _ in every]
    each = [codec.decode(one).leaves() for one in messages]
    columns = [[leaves[place] for leaves in each] for place in places]
    whole = [_array(one, c) for (_, one), c in zip(every, columns, strict=True)]
    return dict(_split(every, whole, only))


def _array(one: Field, column: list[Any]) -> Values:
    if one.shape:
        return np.array(column, one.element).reshape(-1, *one.shape)
    if one.dtype == "bytes":
        return np.array([leaf.hex() for leaf in column], "U")
    if one.item is not None:
        return np.array(["; ".join(map(repr, leaf)) for leaf in column], "U")
    kind = {"bool": "?", "str": "U", "choice": "U"}.get(one.dtype, "f8")
    return np.array(column, kind)


def _names(file: McapFile, key: str) -> Iterator[tuple[str, Field]]:
    """Yield the columns of a port, in order; of an array, one for each element."""
    for path in file.ordered(key):
        one = file.schemas[key].fields[file.schemas[key].paths.index(path)]
        yield from ((name, one) for name in elements(path, one))


def _split(
    rows: Sequence[tuple[str, Field]], whole: Sequence[Values], only: str
) -> Iterator[tuple[str, Values]]:
    """Yield name and values (n,) of each column, or of one; whole: of each field."""
    for (path, one), values in zip(rows, whole, strict=True):
        for name, index in elements(path, one).items():
            if only in ("", name):
                found = values[(slice(None), *index)]
                numeric = one.shape or one.dtype == "int"
                yield name, found.astype(np.float64) if numeric else found.copy()

"""The columns of one agent in an MCAP file, as those of a CSV file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict import Field, Schema, cdr
from rems_net.pictures import is_picture
from rems_net.recordings.csv_file import Column, heading
from rems_net.recordings.mcap.reader import McapFile

Values = NDArray[Any]
#: ports in this order; what else an agent writes follows
PORTS = ("command", "state", "sensors")


#: of all columns the first
TIME = Column(0, heading("time", "s"), "time", "s")


def agents_of(file: McapFile) -> list[str]:
    """Return the keys of the agents that have written something."""
    return sorted({_agent(key) for key in file.channels})


def read_columns(file: McapFile, agent: str, *only: str) -> dict[Column, Values]:
    """Return the columns (n,) of an agent, or of some ports; the first is the time.

    They are those of a CSV file: numbers are floats, bytes hexadecimal digits, and
    pictures are left out. A port that was not written at one of the times has the
    value of before.
    """
    keys = [f"{agent}/{port}" for port in only] or file.channels
    keys = [key for key in keys if key in file.channels and _agent(key) == agent]
    ports = sorted(keys, key=lambda key: _place(key.rpartition("/")[2], PORTS))
    read = {key: _read(file, key) for key in ports}
    every = np.unique(np.concatenate([times for times, _ in read.values()]))
    made = {TIME: every / 1e9}
    first = _state_at_start(file, agent)
    for key, (times, found) in read.items():
        schema, port = file.schemas[key], key.rpartition("/")[2]
        units = {name: unit_of(one) for name, one in _names(schema)}
        names = {name: heading(f"{port}/{name}", units[name]) for name in found}
        if len(times) != len(every):
            default = _parsed(schema, [cdr(schema).encode(schema())])
            place = np.searchsorted(times, every, side="right")
            for name in found:
                found[name] = np.concatenate((default[name], found[name]))[place]
        for name in sorted(names, key=lambda name: _place(names[name], first)):
            about = len(made), names[name], f"{port}/{name}", units[name]
            made[Column(*about)] = found[name]
    return made


def _agent(key: str) -> str:
    return key.rpartition("/")[0]


def _place(name: str, known: Sequence[str]) -> int:
    return known.index(name) if name in known else len(known)


def _state_at_start(file: McapFile, agent: str) -> list[str]:
    """Return the headings of a robot's state in the order of its definition.

    A message has its fields in the order of their names.
    """
    kind, _, name = agent.partition("/")
    told = file.manifest() if kind == "robot" else None
    start = None if told is None else told.robots.get(name)
    return [] if start is None else [*start.state]


def _read(file: McapFile, key: str) -> tuple[Values, dict[str, Values]]:
    """Return the times (n,) [ns] of a port, and its columns (n,)."""
    times: list[int] = []
    blocks: dict[str, list[Values]] = {}
    for some, found in read_blocks(file, key):
        times += some
        for name, values in found.items():
            blocks.setdefault(name, []).append(values)
    columns = {name: np.concatenate(some) for name, some in blocks.items()}
    return np.array(times, np.int64), columns or _parsed(file.schemas[key], [])


def read_blocks(
    file: McapFile, key: str
) -> Iterator[tuple[list[int], dict[str, Values]]]:
    """Yield times [ns] and columns of a port, chunk by chunk."""
    for times, messages in file.messages(key):
        with file.readable():
            yield times, _parsed(file.schemas[key], messages)


def _parsed(schema: Schema, messages: Sequence[bytes]) -> dict[str, Values]:
    """Return columns of messages. Raises ValueError for one that does not fit."""
    codec = cdr(schema)
    if (layout := codec.layout) is not None:
        if any(len(one) != layout.itemsize for one in messages):
            raise ValueError("a message is not as long as its schema says")
        rows = np.frombuffer(b"".join(messages), layout)
        return dict(_split(schema, [rows[path] for path in schema.paths]))
    each = [codec.decode(one).leaves() for one in messages]
    columns = [list(column) for column in zip(*each, strict=True)]
    whole = zip(schema.fields, columns or [[] for _ in schema.fields], strict=True)
    return dict(_split(schema, [_array(one, column) for one, column in whole]))


def _array(one: Field, column: list[Any]) -> Values:
    if one.shape:
        return np.array(column, one.element).reshape(-1, *one.shape)
    if one.dtype == "bytes":
        return np.array([leaf.hex() for leaf in column], "U")
    if one.item is not None:
        return np.array(["; ".join(map(repr, leaf)) for leaf in column], "U")
    kind = {"bool": "?", "str": "U", "choice": "U"}.get(one.dtype, "f8")
    return np.array(column, kind)


def _names(schema: Schema) -> Iterator[tuple[str, Field]]:
    """Yield the columns of a schema; of an array, one for each element."""
    for path, one in schema.rows():
        if not is_picture(one):
            for index in np.ndindex(one.shape):
                yield path + "".join(f"[{i}]" for i in index), one


def _split(schema: Schema, whole: Sequence[Values]) -> Iterator[tuple[str, Values]]:
    """Yield name and values (n,) of each column; whole: of each field."""
    for (path, one), values in zip(schema.rows(), whole, strict=True):
        if not is_picture(one):
            for index in np.ndindex(one.shape):
                found = values[(slice(None), *index)]
                numeric = one.shape or one.dtype == "int"
                name = path + "".join(f"[{i}]" for i in index)
                yield name, found.astype(np.float64) if numeric else found.copy()


def unit_of(one: Field) -> str:
    """Return what stands as the unit above a column: "rad/s", "bool", "text"."""
    if one.shape or one.dtype in ("float", "int"):
        return one.unit
    return "bool" if one.dtype == "bool" else "text"

"""Lines of a CSV file of ours: headings, and cells of values of every kind."""

import csv
import io
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from rems_net.defdict import Field
from rems_net.pictures import is_picture
from rems_net.recordings.csv_file import heading, shielded

#: In this order; what else a robot writes follows.
PORTS = ("command", "state", "sensors")


def order(port: str) -> tuple[int, str]:
    """Return the place of a port among those of an agent."""
    return (PORTS.index(port) if port in PORTS else len(PORTS), port)


def headings(name: str, field: Field) -> Iterator[str]:
    """Yield what stands above the cells of a field; nothing above a picture."""
    unit = {"bool": "bool", "float": field.unit, "int": field.unit}.get(
        field.dtype, "text"
    )
    if not field.shape:
        yield heading(name, unit)
        return
    if is_picture(field):
        return
    for index in np.ndindex(field.shape):
        yield heading(name + "".join(f"[{i}]" for i in index), field.unit)


def cells(leaf: Any) -> list[str]:
    """Return the cells of a value: a number, a truth value, text, bytes, an array."""
    if isinstance(leaf, float):
        return [repr(leaf)]
    if isinstance(leaf, np.ndarray):
        if is_picture(leaf):
            return []
        return [repr(x) for x in (leaf * 1).ravel().tolist()]
    if isinstance(leaf, bytes):
        return [leaf.hex()]
    if isinstance(leaf, tuple):
        return ["; ".join(repr(item) for item in leaf)]
    return [shielded(leaf) if isinstance(leaf, str) else str(leaf)]


def line(cells: Sequence[str]) -> bytes:
    """Return one line; a cell is quoted if it has to be."""
    plain = ",".join(cells)
    odd = plain.count(",") != len(cells) - 1
    if odd or '"' in plain or "\n" in plain or "\r" in plain:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(cells)
        return text.getvalue().encode()
    return f"{plain}\n".encode()

"""Lines of a CSV file of ours: headings, and cells of values of every kind."""

import csv
import io
from collections.abc import Sequence
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


def headings(name: str, field: Field) -> list[str]:
    """Return what stands above the cells of a field; nothing above a picture."""
    return [heading(one, unit_of(field)) for one in elements(name, field)]


def elements(name: str, field: Field) -> dict[str, tuple[Any, ...]]:
    """Return the columns of a field by name, each with its place in an array.

    A field that is no array has one column, and a picture none.
    """
    places = () if is_picture(field) else np.ndindex(field.shape)
    return {name + "".join(f"[{i}]" for i in at): at for at in places}


def unit_of(field: Field) -> str:
    """Return what stands as the unit above a column: "rad/s", "bool", "text"."""
    if field.shape or field.dtype in ("float", "int"):
        return field.unit
    return "bool" if field.dtype == "bool" else "text"


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

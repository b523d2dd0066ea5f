"""The table of a sweep: a row for each run, and a unit in each heading."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from rems_net.recordings.csv_file import heading
from rems_net.recordings.export.lines import cells, line
from rems_net.recordings.table import Table
from rems_net.sweeps.factors import quantities
from rems_net.sweeps.work import Row, Run

#: name and unit of each column, and its value in each row; None if it has none
Column = tuple[str, list[Any]]


def columns(
    runs: Sequence[Run], rows: Sequence[Row], names: Sequence[str], some: Sequence[str]
) -> list[Column]:
    """Return the columns of the runs that have a row, in the order of their numbers.

    runs: of the sweep.  names: of its factors.  some: names of its measures.
    """
    of = {run.number: run for run in runs}
    rows = sorted(rows)
    here = [of[row.number] for row in rows]
    made: list[Column] = [("run", [row.number for row in rows])]
    for name in names:
        # The units of all runs: a table of some of them has the same headings.
        every, unit = quantities([run.point[name] for run in runs])
        value = dict(zip((run.number for run in runs), every, strict=True))
        made.append((heading(name, unit), [value[run.number] for run in here]))
    made.append(("seed", [run.seed for run in here]))
    made.append(("status", [row.status for row in rows]))
    made.append(("ticks", [row.ticks for row in rows]))
    for i, name in enumerate(some):
        found = [row.values[i] if row.values else (None, "") for row in rows]
        unit = next((unit for value, unit in found if value is not None), "")
        made.append((heading(name, unit), [value for value, _ in found]))
    return [*made, ("error", [row.error for row in rows])]


def written(made: Iterable[Column]) -> bytes:
    """Return columns as a CSV file."""
    names, values = zip(*made, strict=True)
    rows = zip(*values, strict=True)
    texts = [line([c for one in row for c in _cell(one)]) for row in rows]
    return b"".join([line([*names]), *texts])


def _cell(value: Any) -> list[str]:
    if isinstance(value, list | dict):
        return [str(value)]
    return [""] if value is None else cells(value)


def table(made: Iterable[Column]) -> Table:
    """Return columns as arrays, which pandas takes; a missing number is NaN."""
    return Table((name, _array(values)) for name, values in made)


def _array(values: list[Any]) -> np.ndarray[Any, Any]:
    kinds = {type(one) for one in values if one is not None}
    if kinds and kinds <= {int, float, bool}:
        if None in values or kinds == {int, float}:
            return np.array([np.nan if v is None else float(v) for v in values])
        return np.array(values)
    return np.array(["" if one is None else str(one) for one in values], dtype=object)

"""The columns of one robot, as arrays with units, and as a table for pandas."""

import importlib
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from rems_net.defdict import Field, boolean, text
from rems_net.errors import UnknownFieldError, nearest, some
from rems_net.recordings.csv_file import Column, CsvFile


class Columns(Mapping[str, Any]):
    """The columns of one robot, by name without the unit: `time`, `state/x`.

    Each is an array (n,) of unyt with its unit; of numpy where it has none.
    """

    def __init__(
        self,
        name: str,
        columns: Mapping[Column, np.ndarray[Any, Any]],
        seconds: np.ndarray[Any, Any],
        settled: float | None = None,
    ):
        self.name, self._seconds = name, seconds
        #: s. Its pose counts from then on; None if it does from the start.
        self.settled = settled
        self._columns = {column.name: column for column in columns}
        self._values = columns

    @cached_property
    def table(self) -> "Table":
        """All columns, by heading, with the unit in it."""
        return Table((one.heading, self._values[one]) for one in self._values)

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __contains__(self, name: object) -> bool:
        return name in self._columns  # without making the column: unyt takes a second

    def __getitem__(self, name: str) -> Any:
        """Return one column. Raises UnknownFieldError."""
        column = self._columns.get(name)
        if column is None:
            raise UnknownFieldError(
                f"{self.name} has no column {name!r}; it has "
                f"{some(self)}.{nearest(name, self)} (R0841)"
            )
        values, unit = self._values[column], self.unit(name)
        if not unit:
            return values
        unyt: Any = importlib.import_module("unyt")
        return unyt.unyt_array(values, unit)

    def plain(self, name: str) -> np.ndarray[Any, Any]:
        """Return a column without its unit."""
        return self._values[self._columns[name]]

    def part(self, rows: slice) -> "Table":
        """Return some rows of all columns."""
        return Table((one.heading, self._values[one][rows]) for one in self._values)

    def heading(self, name: str) -> str:
        """Return the heading of a column."""
        return self._columns[name].heading

    def columns(self) -> list[Column]:
        """Return the columns: name, unit, and both as a heading."""
        return list(self._columns.values())

    def seconds(self) -> np.ndarray[Any, Any]:
        """Return the ends of the steps (n,), s."""
        return self._seconds

    def unit(self, name: str) -> str:
        """Return the unit of a column; "" if it has none."""
        unit = self._columns[name].unit
        return "" if unit in ("text", "bool", "ratio") else unit

    def __repr__(self) -> str:
        return repr(self.table)


def read_csv(path: Path) -> Columns:
    """Return the columns of one robot from its CSV file. Raises ExperimentError."""
    file = CsvFile(path)
    return read_columns(file, [one for one in file.columns if not _is_comment(one)])


def read_columns(file: CsvFile, wanted: Sequence[Column]) -> Columns:
    """Return some columns of a file. Raises ExperimentError."""
    rows = file.numbers([(one, _field(one)) for one in wanted])
    cells = map(np.array, zip(*rows.cells, strict=True))
    read = dict(zip(wanted, cells, strict=True))
    return Columns(file.path.stem, read, np.array(rows.times))


class Table(dict[str, np.ndarray[Any, Any]]):
    """Heading to array: what `pandas.DataFrame` takes. Prints a line for each."""

    def __missing__(self, heading: object) -> NoReturn:
        raise UnknownFieldError(
            f"there is no column {heading!r}; a heading has its unit: {some(self)}."
            f"{nearest(heading, self)} (R0841)"
        )

    def __repr__(self) -> str:
        rows = len(next(iter(self.values()), ()))
        lines: list[tuple[str, ...]] = [("", "first", "last", "least", "most")]
        for heading, values in self.items():
            ends = [values[0], values[-1]] if rows else []
            if rows and values.dtype.kind != "U":
                ends += [values.min(), values.max()]
            cells = [_show(value) for value in ends] + [""] * (4 - len(ends))
            lines.append((heading, *cells))
        return "\n".join([f"{rows} rows", *aligned(lines)])


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return lines of columns: the first to the left, the others to the right."""
    wide = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join([first.ljust(wide[0]), *map(str.rjust, rest, wide[1:])]).rstrip()
        for first, *rest in rows
    ]


def _field(column: Column) -> Field:
    if column.unit == "text":
        return text()
    return boolean() if column.unit == "bool" else Field("float", "")


def _is_comment(column: Column) -> bool:
    return column.name.strip().lower().startswith("comment")


def _show(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)[:12]

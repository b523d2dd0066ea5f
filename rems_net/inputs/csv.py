"""CsvInput: commands from a CSV file, in our format or the class's."""

import re
from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rems_net.agents.agent import Input
from rems_net.agents.ports import Out, Settings
from rems_net.agents.tick import Tick
from rems_net.defdict import (
    DefDict,
    Field,
    Schema,
    array,
    boolean,
    number,
    percent,
    text,
)
from rems_net.errors import ExperimentError, RemsError, nearest, some
from rems_net.recordings.csv_file import Cell, Column, CsvFile

#: percent of full speed. Columns of the class's files.
CLASS_COLUMNS = {"inpt.wh.l": "wheel/left", "inpt.wh.r": "wheel/right"}
PREFIX = "command/"
#: ports in our own files; an input uses the commands only
PORTS = ("command", "state", "sensors")

_ELEMENT = re.compile(r"(.*?)((?:\[\d+\])+)")


class CsvInput(Input):
    """Plays a CSV file.

    A row holds UNTIL its time: over the step (t - dt, t] the row applies that covers
    the middle of the step. After the last row every value is back at its default, 0.
    `file` is relative to the experiment's folder.
    """

    options = Settings(file=text(max_len=4096, doc="a CSV file"))
    value = Out()

    def prepare(self) -> None:
        """Read and check the whole file. Raises ExperimentError."""
        super().prepare()
        shown = self.options.file
        if not shown:
            raise ExperimentError(
                'its file is not named; write options={"file": "keys.csv"}. (R0451)'
            )
        file = CsvFile(self.folder / shown, shown)
        wanted = _commands(file)
        fields = [(column, _field(file, column)) for column, _ in wanted]
        rows = file.numbers(fields)
        paths = [path for _, path in wanted]
        places, entries = _gather(file, paths, [field for _, field in fields])
        self._times, self._cells, self._places = rows.times, rows.cells, places
        self.settle("value", Schema(f"{self.name}.value", entries))
        self._lines, self._rest = rows.lines, self.value.copy()
        self._row: tuple[int, dict[str, Any]] = -1, {}
        for time, (line, values) in zip(self._times, self.foreseen(), strict=True):
            if time > 0:
                break
            # The class's files begin with such a row, without any command.
            if self.value.schema(values) != self._rest:
                raise ExperimentError(
                    f"{shown}, line {line}, column {file.time.heading!r}: a row holds "
                    f"until its time, so this one, at {time:g} s, is never played; "
                    "write when it ends, or remove the line. (R0451)"
                )

    def foreseen(self) -> Iterator[tuple[int, dict[str, Any]]]:
        """Yield all rows, each with its line."""
        for line, cells in zip(self._lines, self._cells, strict=True):
            yield line, {p: _pick(cells, at) for p, at in self._places.items()}

    def file(self) -> Path:
        """Return the path of the file."""
        return self.folder / str(self.options.file)

    @property
    def end(self) -> float:
        """Time of the last row [s]."""
        return self._times[-1]

    def read(self, tick: Tick) -> DefDict | dict[str, Any]:
        """Return the row that covers the middle of the step."""
        row = bisect_right(self._times, tick.t - tick.dt / 2)
        if row == len(self._times):
            return self._rest
        if self._row[0] != row:  # a row holds for many ticks
            cells = self._cells[row]
            self._row = row, {p: _pick(cells, at) for p, at in self._places.items()}
        return self._row[1]


Place = int | np.ndarray[Any, Any]


def _pick(cells: tuple[Cell, ...], place: Place) -> Any:
    if isinstance(place, int):
        return cells[place]
    return np.array([cells[i] for i in place.flat]).reshape(place.shape)


def _commands(file: CsvFile) -> list[tuple[Column, str]]:
    """Return the columns that hold commands, each with its field's path."""
    ours = [
        (c, c.name[len(PREFIX) :]) for c in file.columns if c.name.startswith(PREFIX)
    ]
    known = [(c, CLASS_COLUMNS.get(c.name, "")) for c in file.columns]
    known = [(c, path) for c, path in known if path]
    for column in file.columns:
        # Without this check a typo in a name would be a robot that stands still.
        if column.name.startswith("inpt.") and column.name not in CLASS_COLUMNS:
            raise _unknown(file, column, list(CLASS_COLUMNS))
        first, slash, rest = column.heading.partition("/")
        if slash and first not in PORTS and nearest(first, PORTS):
            right = nearest(first, PORTS).split("'")[1]
            raise _unknown(file, column, [f"{right}/{rest}"])
    names = [path for _, path in ours or known]
    twice = next((n for n in names if names.count(n) > 1), None)
    if twice is not None:
        raise ExperimentError(
            f"{file.shown}, line 1: there are two columns for {twice!r}; remove one."
            " (R0451)"
        )
    if not names:
        headings = [c.heading for c in file.columns]
        raise ExperimentError(
            f"{file.shown}, line 1: no column is a command; expected "
            "'command/<field> [<unit>]', or 'inpt.wh.l' and 'inpt.wh.r', but the "
            f"columns are {some(map(repr, headings))}. (R0451)"
        )
    return ours or known


def _unknown(file: CsvFile, column: Column, candidates: list[str]) -> ExperimentError:
    return ExperimentError(
        f"{file.shown}, line 1: there is no column {column.heading!r}; expected "
        f"'command/<field> [<unit>]', or 'inpt.wh.l' and 'inpt.wh.r'."
        f"{nearest(column.heading, candidates)} (R0451)"
    )


def _field(file: CsvFile, column: Column) -> Field:
    """Return the field for a column, from its heading."""
    if column.name in CLASS_COLUMNS or column.unit in ("percent", "%"):
        return percent()
    if column.unit == "bool":
        return boolean()
    if column.unit == "text":
        return text()
    try:
        return number(column.unit)
    except RemsError as error:
        raise ExperimentError(
            f"{file.shown}, line 1, column {column.heading!r}: {error}"
        ) from None


def _gather(
    file: CsvFile, paths: list[str], fields: list[Field]
) -> tuple[dict[str, Place], dict[str, Field]]:
    """Return the cells of each field; `joints[0]`, `joints[1]` are one array."""
    places: dict[str, Place] = {}
    entries: dict[str, Field] = {}
    arrays: dict[str, dict[tuple[int, ...], int]] = {}
    for i, (path, field) in enumerate(zip(paths, fields, strict=True)):
        match = _ELEMENT.fullmatch(path)
        if match is None:
            places[path], entries[path] = i, field
            continue
        index = tuple(int(n) for n in match[2][1:-1].split("]["))
        arrays.setdefault(match[1], {})[index] = i
        entries[match[1]] = field
    for path, elements in arrays.items():
        shape = tuple(max(axis) + 1 for axis in zip(*elements, strict=False))
        if any(len(e) != len(shape) for e in elements) or len(elements) != np.prod(
            shape
        ):
            raise ExperimentError(
                f"{file.shown}, line 1: {path!r} is an array with elements missing; "
                f"expected {path}[0], {path}[1] and so on. (R0451)"
            )
        places[path] = np.array([elements[i] for i in np.ndindex(shape)]).reshape(shape)
        entries[path] = array(shape, entries[path].unit)
    return places, entries

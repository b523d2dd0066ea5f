"""A CSV file of a run: its header, and its numbers, checked line by line.

Ours has a unit in each heading: `time [s]`, `command/wheel/left [rad/s]`; a plain
number has none. The class's has names only: `timestamp`, `inpt.wh.l`, `state.x`.
A row is stamped at the END of its step.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import inf, isnan
from pathlib import Path

from rems_net.defdict import Field, parse_quantity
from rems_net.errors import ExperimentError, RemsError, nearest, some, whereabouts
from rems_net.recordings.spreadsheet import plain
from rems_net.system.reading import TABLE, read_file

TIMES = ("time", "timestamp")
EXAMPLE = "'time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]'"

#: what begins a formula in a spreadsheet, and the mark for text that is none
FORMULAS = ("=", "+", "-", "@", "\t", "\r", "'")

Cell = float | bool | str

_HEADING = re.compile(r"\s*(.*?)\s*(?:\[([^\[\]]*[^\[\]\d][^\[\]]*)\])?\s*")
_TRUTH = {"True": True, "False": False}


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its place, its heading, and the heading's name and unit."""

    index: int
    heading: str
    name: str
    unit: str


def heading(name: str, unit: str) -> str:
    """Return the heading of a column: `state/heading [rad]`, `sensors/compass/x`."""
    return f"{name} [{unit}]" if unit else name


def shielded(text: str) -> str:
    """Return a cell that a spreadsheet takes for the text and not for a formula."""
    return f"'{text}" if text[:1] in FORMULAS else text


def unshielded(cell: str) -> str:
    """Return the text of which `shielded` made this cell."""
    return cell[1:] if cell[:1] == "'" and cell[1:2] in FORMULAS else cell


def recorded(agent: str) -> str:
    """Return the name of an agent's file: `sim` of robot/sim, else `world.arena`."""
    kind, _, name = agent.partition("/")
    return name if kind == "robot" else f"{kind}.{name}"


def named(agent: str) -> str:
    """Return an agent's name in a recording: `sim`, `world.arena`, `input/keys`."""
    return agent if agent.startswith(("input/", "process/")) else recorded(agent)


def read_text(path: Path, shown: str) -> str:
    """Return the text of a CSV file. Raises ExperimentError.

    shown: its name in messages
    """
    try:
        return plain(read_file(path, TABLE), shown)
    except OSError as error:
        if not shown.isprintable():  # Windows calls such a name invalid
            raise ExperimentError(
                f"there is no file {shown!r}: in double quotes a backslash is the "
                "beginning of another character. Write the path in single quotes, or "
                "with slashes. (R0804)"
            ) from None
        if isinstance(error, FileNotFoundError):
            raise ExperimentError(
                f"there is no file {whereabouts(path, '.csv')} (R0804)"
            ) from None
        raise ExperimentError(
            f"cannot read {shown}: {error.strerror}. (R0804)"
        ) from None


class CsvFile:
    """A file read whole; `shown` is what messages call it.

    time: name and unit of the column of times, in files of other programs. Raises
    ExperimentError, in one sentence, for anything wrong with it.
    """

    def __init__(
        self, path: Path, shown: str = "", time: tuple[str, str] | None = None
    ):
        self.path, self.shown = path, shown or path.name
        text = read_text(path, self.shown)
        self._rows = csv.reader(text.splitlines(keepends=True), strict=True)
        # Python reads 1_000 as a number; a slip of the hand is none.
        self._float = _strictly if "_" in text else float
        with self._readable():
            first = next(self._rows, None)
        if first is None or not "".join(first).strip():
            raise ExperimentError(
                f"{self.shown} is empty; expected a header such as {EXAMPLE} in "
                "line 1, and one line per step below. (R0804)"
            )
        self.columns = [_column(i, cell) for i, cell in enumerate(first)]
        self.time = self._time_column() if time is None else self._named(*time)

    def _named(self, name: str, unit: str) -> Column:
        names = [column.name for column in self.columns]
        if name not in names:
            raise ExperimentError(
                f"{self.shown}, line 1: expected a column {name!r}, with the times, "
                f"but the columns are {some(map(repr, names))}."
                f"{nearest(name, names)} (R0844)"
            )
        return replace(self.columns[names.index(name)], unit=unit)

    def _time_column(self) -> Column:
        for column in self.columns:
            if column.name in TIMES:
                return column
        names = [c.name for c in self.columns]
        hint = next((h for h in (nearest(n, TIMES) for n in names) if h), "")
        headings = [repr(c.heading) for c in self.columns]
        raise ExperimentError(
            f"{self.shown}, line 1: expected a column 'time [s]' or 'timestamp', but "
            f"the columns are {some(headings)}.{hint} (R0804)"
        )

    def numbers(self, wanted: Sequence[tuple[Column, Field]]) -> "Rows":
        """Read the time and the wanted columns, each cell checked by its field.

        Times must rise from line to line.
        """
        scale = self._seconds()
        times: list[float] = []
        rows: list[tuple[Cell, ...]] = []
        lines: list[int] = []
        limits = [(c, c.index, f, *f.limits) for c, f in wanted if f.dtype == "float"]
        others = [(c, c.index, f) for c, f in wanted if f.dtype != "float"]
        before = -inf
        at, stamp, to_float = self.time.index, Field("float", "s"), self._float
        for row in self._full_rows():
            try:
                time = to_float(row[at]) * scale
                cells: list[Cell] = [to_float(row[i]) for _, i, _, _, _ in limits]
            except ValueError:
                time, cells = inf, []
            good = before < time < inf and len(cells) == len(limits)
            if not good or not all(
                low <= x <= high  # type: ignore[operator]
                for x, (_, _, _, low, high) in zip(cells, limits, strict=True)
            ):
                raise self._wrong_cell(
                    row, [(self.time, stamp), *wanted], before, scale
                )
            if others:
                cells = self._in_order(wanted, cells, row, others)
            times.append(time)
            rows.append(tuple(cells))
            lines.append(self._rows.line_num)
            before = time
        if not times:
            raise ExperimentError(
                f"{self.shown} has a header and no line below it; expected one line "
                "per step. (R0804)"
            )
        return Rows(times, rows, lines)

    def _full_rows(self) -> Iterator[list[str]]:
        count = len(self.columns)
        # Only behind a last column that nobody reads may there be more cells.
        loose = self.columns[-1].name.strip().lower().startswith("comment")
        with self._readable():
            for row in self._rows:
                if loose and len(row) == count - 1 and "//" in row[-1]:
                    # Typed by hand: the comma before the comment is missing.
                    cell, slashes, rest = row[-1].partition("//")
                    row = [*row[:-1], cell, slashes + rest]
                if len(row) == count or (loose and len(row) > count):
                    yield row
                elif row and not (len(row) == 1 and not row[0].strip()):
                    raise ExperimentError(
                        f"{self.shown}, line {self._rows.line_num}: expected "
                        f"{count} cells as in the header, but got {len(row)}."
                        f"{_perhaps_commas(row, count)} (R0804)"
                    )

    @contextmanager
    def _readable(self) -> Iterator[None]:
        try:
            yield
        except csv.Error as error:
            raise ExperimentError(
                f"{self.shown}, line {self._rows.line_num}: this is no CSV ({error}). "
                "(R0804)"
            ) from None

    def _in_order(
        self,
        wanted: Sequence[tuple[Column, Field]],
        numbers: list[Cell],
        row: list[str],
        others: Sequence[tuple[Column, int, Field]],
    ) -> list[Cell]:
        words: dict[int, Cell] = {}
        for column, index, field in others:
            cell = row[index].strip() if field.dtype == "bool" else row[index]
            if field.dtype == "bool" and cell not in _TRUTH:
                raise self._wrong(column, "True or False", cell)
            words[index] = _TRUTH[cell] if field.dtype == "bool" else unshielded(cell)
        rest = iter(numbers)
        return [words[c.index] if c.index in words else next(rest) for c, _ in wanted]

    def _seconds(self) -> float:
        try:
            return parse_quantity(f"1 {self.time.unit or 's'}", "s")
        except RemsError:
            raise ExperimentError(
                f"{self.shown}, line 1, column {self.time.heading!r}: expected a time, "
                f"such as 'time [s]', but {self.time.unit!r} is no unit of time. "
                "(R0804)"
            ) from None

    def _wrong_cell(
        self,
        row: list[str],
        wanted: Sequence[tuple[Column, Field]],
        before: float,
        scale: float,
    ) -> ExperimentError:
        """Find what is wrong with a row that was refused."""
        for column, field in wanted:
            low, high = field.limits
            number = _float(row[column.index])
            if field.dtype == "float" and not low <= number <= high:
                unit = f" in {field.unit}" if field.unit else ""
                reach = f" from {low:g} to {high:g}" if field.range else ""
                return self._wrong(column, f"a number{unit}{reach}", row[column.index])
        last = before / scale
        return self._wrong(
            self.time,
            f"a time after {last:g}, which the line before has",
            row[self.time.index],
            " Sort the lines by time." if _float(row[self.time.index]) < last else "",
        )

    def _wrong(
        self, column: Column, expected: str, came: str, hint: str = ""
    ) -> ExperimentError:
        return ExperimentError(
            f"{self.shown}, line {self._rows.line_num}, column {column.heading!r}: "
            f"expected {expected}, but got {came!r}.{hint} (R0804)"
        )


@dataclass(frozen=True, slots=True)
class Rows:
    """`times` [s], rising, and the wanted cells of each row, in the order asked for.

    lines: where in the file each row is
    """

    times: list[float]
    cells: list[tuple[Cell, ...]]
    lines: list[int]


def _perhaps_commas(row: list[str], count: int) -> str:
    """Return a hint for 0,5 in a line whose commas separate cells, or nothing."""
    if len(row) <= count or any(isnan(_float(cell)) for cell in row):
        return ""
    return " A decimal comma? Write points, or put ';' between the cells of all lines."


def _column(index: int, cell: str) -> Column:
    match = _HEADING.fullmatch(cell)
    name, unit = (match[1], match[2] or "") if match else (cell, "")
    return Column(index, cell.strip(), name, unit)


def _strictly(cell: str) -> float:
    return float(cell.replace("_", "?"))


def _float(cell: str) -> float:
    try:
        return _strictly(cell)
    except ValueError:
        return float("nan")

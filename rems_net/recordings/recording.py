"""A recording: the CSV files of a run, as arrays with units, tables and pictures."""

from __future__ import annotations

import importlib
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

import numpy as np

from rems_net.defdict import Field, boolean, text
from rems_net.errors import ExperimentError, UnknownFieldError, nearest, some
from rems_net.recordings.album import Album, album_of
from rems_net.recordings.csv_file import Column, CsvFile
from rems_net.recordings.manifest import Manifest, read_manifest

if TYPE_CHECKING:
    from rems_net.recordings.comparison import Pair
    from rems_net.recordings.differences import Difference
    from rems_net.recordings.parting.why import Why

#: robots that are named where a recording is printed
NAMED = 8
#: Those that are open, by folder: a later run may move what they read.
_open: WeakSet[Recording] = WeakSet()


def read(folder: Path | str) -> Recording:
    """The recording in the folder of a run, such as "runs/lab".

    Raises ExperimentError for a folder without one.
    """
    path = Path(folder)
    if not path.is_dir():
        what = f"{path} is a file" if path.exists() else f"There is no folder {path}"
        raise ExperimentError(
            f"{what}; expected the folder of a run, such as runs/demo.{_near(path)}"
        )
    files = sorted(path.glob("*.csv"), key=natural)
    if not files and not any(path.glob("*/*.png")):
        raise ExperimentError(
            f"There is no CSV file in {path}; expected the folder of a run, "
            "such as runs/demo."
        )
    return Recording(path.resolve(), files)


def _near(path: Path) -> str:
    """Which folder of a run was meant: that of this file, or one of such a name."""
    if path.is_file() and path.suffix == ".csv":
        return f" Did you mean {path.parent.as_posix()!r}?"
    runs = path.parent, path.parent / "runs"
    here = {one.name: one for some in runs for one in some.glob("*") if one.is_dir()}
    found = nearest(path.stem, here)
    return next(
        (found.replace(n, here[n].as_posix()) for n in here if f"'{n}'" in found), ""
    )


class Recording(Mapping[str, "Columns"]):
    """What a run left: `recording["sim"]["state/x"]` is an array with its unit.

    folder: where it is      files: what the outputs made
    Robots are in natural order: r2 comes before r10.
    """

    def __init__(self, folder: Path, files: Sequence[Path]):
        self.folder, self.files = folder, list(files)
        self._read: dict[str, Columns] = {}
        _open.add(self)

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other

    def __iter__(self) -> Iterator[str]:
        return iter(path.stem for path in self.tables())

    def __len__(self) -> int:
        return len(self.tables())

    def __getitem__(self, robot: str) -> Columns:
        """The columns of one robot. Raises UnknownFieldError."""
        if robot not in self._read:
            paths = {path.stem: path for path in self.tables()}
            if robot not in paths:
                have = (
                    some(paths) if paths else "none; an output of type csv writes them"
                )
                raise UnknownFieldError(
                    f"there is no CSV file of {robot!r} in {self.folder}; there is "
                    f"{have}.{nearest(robot, paths)}"
                )
            self._read[robot] = Columns(paths[robot])
        return self._read[robot]

    def __repr__(self) -> str:
        names = [*self][:NAMED] + ["..."] * (len(self) > NAMED)
        return f"<recording in {self.folder} of {', '.join(names) or 'nobody'}>"

    def tables(self) -> list[Path]:
        """The CSV files, in natural order."""
        found = [path for path in self.files if path.suffix == ".csv"]
        return sorted(found, key=natural)

    def table(self, robot: str) -> Table:
        """All columns of a robot, as `state/x [m]` to a plain array, for pandas."""
        return self[robot].table

    def pictures(self, camera: str) -> Album:
        """What a camera saw, by tick: `recording.pictures("bot.camera")[10]`.

        Each is an array of u1, (height, width, 3). Raises UnknownFieldError.
        """
        return album_of(self.folder, camera)

    def compare(self) -> list[Pair | Difference]:
        """How far each two robots were apart.

        By their poses, where both have x, y and heading; else by the fields of the
        state that both have.
        """
        # Here, as below: most runs end without a look at what they left.
        from rems_net.recordings.comparison import compare, trajectories

        drove = trajectories(self.tables())
        return [*compare(drove), *self.differences({one.name for one in drove})]

    def differences(self, posed: Collection[str]) -> list[Difference]:
        """How far each two robots with a state were apart, but for two of `posed`."""
        from rems_net.recordings.differences import differences

        names = {path.stem: path for path in self.tables()}
        if len(names) < 2 or names.keys() <= set(posed):
            return []
        driven = [
            self[name]
            for name, path in names.items()
            if any(c.name.startswith("state/") for c in CsvFile(path).columns)
        ]
        return differences(driven, posed)

    def why(self, a: str = "", b: str = "") -> Why:
        """Where and why robot `b` parts from robot `a`, computed from the files.

        Without `a`, from the kinematic one, or else the first; without `b`, the first
        of the others. Raises UnknownFieldError, and ExperimentError for two that have
        nothing to compare.
        """
        from rems_net.recordings.parting.both import Both
        from rems_net.recordings.parting.why import reference, why

        names = list(self)
        a = a or reference(names)
        b = b or next((name for name in names if name != a), a)
        others = ", ".join(name for name in names if name != a)
        if a == b:
            raise ExperimentError(f"{a} is compared with another one: {others or '-'}.")
        told = read_manifest(self.folder) or Manifest()
        starts = tuple(told.robots.get(name) for name in (a, b))
        return why(Both(self[a], self[b], starts))

    def plot(self, *fields: str, path: Path | str | None = None) -> Any:
        """Draw it to `plot.png` in its folder, or to `path`; a notebook shows it.

        Without fields: where the robots drove, how far they were apart, and the rest
        of their state. A field is a column ("sensors/lidar/front"), or what it begins
        with ("sensors"), drawn against time. Raises MissingPartError without
        matplotlib, and ExperimentError for a field that nobody has.
        """
        from rems_net.recordings.plot import plot

        return plot(self, fields, Path(path or self.folder / "plot.png"))


class Columns(Mapping[str, Any]):
    """The columns of one robot, by name without the unit: `time`, `state/x`.

    Each is an array (n,) of unyt with its unit; of numpy where it has none.
    """

    def __init__(self, path: Path):
        self.name = path.stem
        file = CsvFile(path)
        wanted = [(c, _field(c)) for c in file.columns if not _is_comment(c)]
        rows = file.numbers(wanted)
        self._seconds = np.array(rows.times)
        cells = zip(*rows.cells, strict=True)
        #: by heading, with the unit in it
        self.table = Table(
            (column.heading, np.array(values))
            for (column, _), values in zip(wanted, cells, strict=True)
        )
        self._columns = {column.name: column for column, _ in wanted}

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __contains__(self, name: object) -> bool:
        return name in self._columns  # without making the column: unyt takes a second

    def __getitem__(self, name: str) -> Any:
        """One column. Raises UnknownFieldError."""
        column = self._columns.get(name)
        if column is None:
            raise UnknownFieldError(
                f"{self.name} has no column {name!r}; it has "
                f"{some(self)}.{nearest(name, self)}"
            )
        values, unit = self.table[column.heading], self.unit(name)
        if not unit:
            return values
        unyt: Any = importlib.import_module("unyt")
        return unyt.unyt_array(values, unit)

    def plain(self, name: str) -> np.ndarray[Any, Any]:
        """A column without its unit."""
        return self.table[self.heading(name)]

    def heading(self, name: str) -> str:
        """What stands above a column."""
        return self._columns[name].heading

    def columns(self) -> list[Column]:
        """What stands above them: name, unit, and both as a heading."""
        return list(self._columns.values())

    def seconds(self) -> np.ndarray[Any, Any]:
        """The ends of the steps (n,), s."""
        return self._seconds

    def unit(self, name: str) -> str:
        """The unit of a column; "" for what has none."""
        unit = self._columns[name].unit
        return "" if unit in ("text", "bool", "ratio") else unit

    def __repr__(self) -> str:
        return repr(self.table)


class Table(dict[str, np.ndarray[Any, Any]]):
    """Heading to array: what `pandas.DataFrame` takes. Prints a line for each."""

    def __repr__(self) -> str:
        rows = len(next(iter(self.values()), ()))
        lines: list[tuple[str, ...]] = [("", "first", "last", "least", "most")]
        for heading, values in self.items():
            ends = [values[0], values[-1]] if rows else []
            if rows and values.dtype.kind != "U":
                ends += [values.min(), values.max()]
            cells = [_show(value) for value in ends] + [""] * (4 - len(ends))
            lines.append((heading, *cells))
        wide = [max(map(len, column)) for column in zip(*lines, strict=True)]
        shown = [f"{rows} rows"]
        for name, *cells in lines:
            right = map(str.rjust, cells, wide[1:])
            shown.append("  ".join([name.ljust(wide[0]), *right]).rstrip())
        return "\n".join(shown)


def natural(path: Path | str) -> list[tuple[int, int, str]]:
    """A key to sort names by, in which r2 comes before r10."""
    name = path.stem if isinstance(path, Path) else path
    parts = re.split(r"(\d+)", name)
    return [(1, int(p), "") if p.isdecimal() else (0, 0, p) for p in parts if p]


def moved(old: Path, new: Path) -> None:
    """Tell the recordings of this process that a folder has got another name."""
    for one in list(_open):
        if one.folder == old:
            one.folder = new
            one.files = [
                new / path.relative_to(old) if path.is_relative_to(old) else path
                for path in one.files
            ]


def _field(column: Column) -> Field:
    if column.unit == "text":
        return text()
    return boolean() if column.unit == "bool" else Field("float", "")


def _is_comment(column: Column) -> bool:
    return column.name.strip().lower().startswith("comment")


def _show(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)[:12]

"""A recording: what a run left in CSV and MCAP files, as arrays, tables, pictures."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

from rems_net.errors import ExperimentError, UnknownFieldError, nearest, some
from rems_net.recordings.album import Album, album_of
from rems_net.recordings.csv_file import CsvFile, recorded
from rems_net.recordings.manifest import Manifest, read_manifest
from rems_net.recordings.mcap.columns import TIME, agents_of, read_columns
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.table import Columns, Table, read_csv

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
    if path.suffix == ".mcap" and path.is_file():
        return Recording(path.resolve().parent, [path.resolve()])
    if not path.is_dir():
        what = f"{path} is a file" if path.exists() else f"There is no folder {path}"
        raise ExperimentError(
            f"{what}; expected the folder of a run, such as runs/demo.{_near(path)}"
        )
    files = sorted([*path.glob("*.csv"), *path.glob("*.mcap")], key=natural)
    if not files and not any(path.glob("*/*.png")):
        raise ExperimentError(
            f"There is no CSV file in {path}, and no MCAP file; expected the folder of "
            "a run, such as runs/demo."
        )
    return Recording(path.resolve(), [file.resolve() for file in files])


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
        self._mcap: dict[Path, McapFile] = {}
        _open.add(self)

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other

    def __iter__(self) -> Iterator[str]:
        return (name for name in self._sources() if "/" not in name)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __getitem__(self, robot: str) -> Columns:
        """The columns of one robot. Raises UnknownFieldError.

        Of an MCAP file also those of an input or a process: `input/keys`.
        """
        if robot not in self._read:
            sources = self._sources()
            if robot not in sources:
                have = "none; an output of type csv or mcap writes them"
                raise UnknownFieldError(
                    f"there is no recording of {robot!r} in {self.folder}; there is "
                    f"{some(sources) if sources else have}.{nearest(robot, sources)}"
                )
            path, agent = sources[robot]
            if agent:
                columns = read_columns(self._file(path), agent)
                self._read[robot] = Columns(robot, columns, columns[TIME])
            else:
                self._read[robot] = read_csv(path)
        return self._read[robot]

    def _file(self, path: Path) -> McapFile:
        """An MCAP file, whose summary is read once."""
        if path not in self._mcap:
            self._mcap[path] = McapFile(path)
        return self._mcap[path]

    def _sources(self) -> dict[str, tuple[Path, str]]:
        """By name, the file that each is in, and its key there; "" in a CSV file."""
        found: dict[str, tuple[Path, str]] = {}
        for path in self.tables():
            if path.suffix == ".csv":
                found[path.stem] = path, ""
        for path in self.tables():
            for agent in agents_of(self._file(path)) if path.suffix == ".mcap" else ():
                kind, _, name = agent.partition("/")
                named = recorded(name, kind) if kind in ("robot", "world") else agent
                found.setdefault(named, (path, agent))
        return {name: found[name] for name in sorted(found, key=natural)}

    def __repr__(self) -> str:
        names = [*self][:NAMED] + ["..."] * (len(self) > NAMED)
        return f"<recording in {self.folder} of {', '.join(names) or 'nobody'}>"

    def tables(self) -> list[Path]:
        """The CSV and MCAP files, in natural order."""
        found = [path for path in self.files if path.suffix in (".csv", ".mcap")]
        return sorted(found, key=natural)

    def manifest(self) -> Manifest:
        """What the run said of itself, in run.json or in its MCAP file."""
        found = read_manifest(self.folder)
        for path in self.tables():
            if found is None and path.suffix == ".mcap":
                found = self._file(path).manifest()
        return found or Manifest()

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

        sources = {n: where for n, where in self._sources().items() if "/" not in n}
        if len(sources) < 2 or sources.keys() <= set(posed):
            return []
        driven = [
            self[name]
            for name, (path, agent) in sources.items()
            if (
                f"{agent}/state" in self._file(path).channels
                if agent
                else any(c.name.startswith("state/") for c in CsvFile(path).columns)
            )
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
        told = self.manifest()
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

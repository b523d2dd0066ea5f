"""A recording: what a run left in CSV and MCAP files, as arrays, tables, pictures."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

from rems_net.errors import ExperimentError, UnknownFieldError, nearest, some
from rems_net.recordings.album import Album, album_of
from rems_net.recordings.csv_file import CsvFile, named
from rems_net.recordings.manifest import Manifest, Start, read_manifest
from rems_net.recordings.mcap.columns import AgentColumns, agents_of
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.names import natural, near
from rems_net.recordings.table import Columns, Table, read_csv

if TYPE_CHECKING:
    from rems_net.recordings.comparison import Pair, Trajectory
    from rems_net.recordings.differences import Difference
    from rems_net.recordings.others.mapping import Like
    from rems_net.recordings.parting.why import Why
    from rems_net.recordings.plot import Picture

#: file of a sweep, beside the folders of its runs
SWEEP = "sweep.json"
#: robots that are named where a recording is printed
NAMED = 8
#: Those that are open, by folder: a later run may move what they read.
_open: "WeakSet[Recording]" = WeakSet()


def read(folder: Path | str, *, like: str = "") -> "Recording":
    """Return the recording in the folder of a run, such as "runs/lab", or in a file.

    like: how CSV files of another program are read: "woodbot-class", or the TOML file
    of a mapping. Raises ExperimentError for a folder without a recording.
    """
    if not isinstance(folder, str | Path):
        raise ExperimentError(
            f"read() takes the folder of a run, such as 'runs/demo'; got "
            f"{folder!r:.60}. (R0840)"
        )
    path = Path(folder)
    if like:
        return _read_like(path, like)
    if path.suffix == ".mcap" and path.is_file():
        return Recording(path.resolve().parent, [path.resolve()])
    if not path.is_dir():
        kind = "file" if path.suffix else "folder"
        what = f"{path} is a file" if path.exists() else f"There is no {kind} {path}"
        raise ExperimentError(
            f"{what}; expected the folder of a run, such as runs/demo.{near(path)} "
            "(R0840)"
        )
    if (path / SWEEP).exists():
        raise ExperimentError(
            f"{path} is a sweep; name one of its runs, such as {path / '001'}. (R0840)"
        )
    files = sorted([*path.glob("*.csv"), *path.glob("*.mcap")], key=natural)
    if not files and not any(path.glob("*/*.png")):
        raise ExperimentError(
            f"There is no CSV file in {path}, and no MCAP file; expected the folder of "
            "a run, such as runs/demo. (R0840)"
        )
    return Recording(path.resolve(), [file.resolve() for file in files])


def _read_like(path: Path, like: str) -> "Recording":
    from rems_net.recordings.others.mapping import like as mapping

    how = mapping(like)
    files = sorted(path.glob("*.csv"), key=natural) if path.is_dir() else [path]
    if not files:
        raise ExperimentError(
            f"There is no CSV file in {path}; expected a folder with the CSV files "
            "that the mapping describes, or one of them. (R0840)"
        )
    files = [file.resolve() for file in files]
    return Recording(files[0].parent, files, how)


class Recording(Mapping[str, "Columns"]):
    """Files of a run: `recording["sim"]["state/x"]` is an array with its unit.

    folder: where it is      files: what the outputs made
    like: the mapping of files of another program
    Robots are in natural order: r2 comes before r10.
    """

    def __init__(self, folder: Path, files: Sequence[Path], like: "Like | None" = None):
        self.folder, self.files, self.like = folder, list(files), like
        self._read: dict[str, Columns] = {}
        self._mcap: dict[Path, McapFile] = {}
        _open.add(self)

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other

    def __iter__(self) -> Iterator[str]:
        return (name for name in self._sources if "/" not in name)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __getitem__(self, robot: str) -> Columns:
        """Return the columns of one robot. Raises UnknownFieldError.

        Of an MCAP file also those of an input or a process: `input/keys`.
        """
        if robot not in self._read:
            path, agent = self.source(robot)
            if agent:
                columns = AgentColumns(self.mcap(path), agent)
                self._read[robot] = Columns(robot, columns, columns.seconds)
            else:
                read = read_csv if self.like is None else self.like.read
                self._read[robot] = read(path)
        return self._read[robot]

    def source(self, name: str) -> tuple[Path, str]:
        """Return the file of an agent, and its key there; "" in a CSV file.

        Raises UnknownFieldError.
        """
        sources = self._sources
        if name not in sources:
            have = "none; an output of type csv or mcap writes them"
            raise UnknownFieldError(
                f"there is no recording of {name!r} in {self.folder}; there is "
                f"{some(sources) if sources else have}.{nearest(name, sources)} "
                "(R0841)"
            )
        return sources[name]

    def mcap(self, path: Path) -> McapFile:
        """Return an MCAP file, whose summary is read once."""
        if path not in self._mcap:
            self._mcap[path] = McapFile(path)
        return self._mcap[path]

    @cached_property
    def _sources(self) -> dict[str, tuple[Path, str]]:
        """Return, by name, the file of each, and its key there; "" in a CSV file."""
        found: dict[str, tuple[Path, str]] = {}
        for path in self.tables():
            if path.suffix == ".csv":
                kind, dot, name = path.stem.partition(".")
                of_agent = dot and kind in ("input", "process")
                found[f"{kind}/{name}" if of_agent else path.stem] = path, ""
        for file in self._mcaps():
            for agent in agents_of(file):
                found.setdefault(named(agent), (file.path, agent))
        return {name: found[name] for name in sorted(found, key=natural)}

    def __repr__(self) -> str:
        names = [*self][:NAMED] + ["..."] * (len(self) > NAMED)
        return f"<recording in {self.folder} of {', '.join(names) or 'nobody'}>"

    def tables(self) -> list[Path]:
        """Return the CSV and MCAP files, in natural order."""
        found = [path for path in self.files if path.suffix in (".csv", ".mcap")]
        return sorted(found, key=natural)

    def passed(self) -> dict[str, str]:
        """Return topics of MCAP files that are not read, each with the reason."""
        return {k: why for file in self._mcaps() for k, why in file.passed.items()}

    def manifest(self) -> Manifest:
        """Return the manifest of the run, from run.json or its MCAP file."""
        inside = (file.told for file in self._mcaps() if file.told.experiment)
        return read_manifest(self.folder) or next(inside, Manifest())

    def _mcaps(self) -> Iterator[McapFile]:
        return (self.mcap(path) for path in self.tables() if path.suffix == ".mcap")

    def table(self, robot: str) -> Table:
        """Return all columns of a robot: `state/x [m]` to a plain array, for pandas."""
        return self[robot].table

    def blocks(self, name: str, size: int) -> Iterator[Table]:
        """Yield the table of an agent, `size` rows at a time."""
        columns = self[name]
        for i in range(0, max(len(columns.seconds()), 1), size):
            yield columns.part(slice(i, i + size))

    def frame(self, name: str, library: str = "pandas") -> Any:
        """Return the table of a robot as a frame of pandas or "polars".

        Raises MissingPartError without the library.
        """
        from rems_net.recordings.export.frames import frame

        return frame(self.table(name), library)

    def export(
        self, *names: str, to: str = "csv", folder: Path | str | None = None
    ) -> list[Path]:
        """Write a file for each robot and world, or for these agents.

        to: "csv", the bytes that an output of type csv writes, or "parquet".
        folder: of the files, by default `export` in its own. Returns their paths.
        """
        from rems_net.recordings.export.files import export

        return export(
            self, names or [*self], Path(folder or self.folder / "export"), to
        )

    def pictures(self, camera: str) -> Album:
        """Return a camera's pictures, by tick: `recording.pictures("bot.camera")[10]`.

        Each is an array of u1, (height, width, 3). Raises UnknownFieldError.
        """
        return album_of(self.folder, camera)

    def compare(self) -> "list[Pair | Difference]":
        """Return how far each two robots were apart.

        By their poses, where both have x, y and heading; else by the fields of the
        state that both have.
        """
        drove = self.trajectories()
        return [*self.pairs(drove), *self.differences({one.name for one in drove})]

    def pairs(self, robots: "Sequence[Trajectory]") -> "list[Pair]":
        """Return how far each two of these robots were apart."""
        # Here, as below: most runs end without a look at what they left.
        from rems_net.recordings.comparison import compare

        return compare(robots)

    def trajectories(self, *only: str) -> "list[Trajectory]":
        """Return where the robots with x, y and heading drove, or these of them."""
        from rems_net.recordings.comparison import trajectory_of

        told, posed = self.manifest(), map(self._posed, only or self)
        found = [trajectory_of(one, told) for one in posed if one is not None]
        return [one for one in found if one is not None]

    def _posed(self, robot: str) -> Columns | None:
        """Return the columns of a robot from which its pose is read, if it has one."""
        from rems_net.recordings.comparison import read_pose

        path, agent = self.source(robot)
        if not agent:
            return read_pose(path) if self.like is None else self[robot]
        if not self._has_state(robot, path, agent):
            return None
        columns = AgentColumns(self.mcap(path), agent, "state")
        return Columns(robot, columns, columns.seconds)

    def differences(self, posed: Collection[str], *only: str) -> "list[Difference]":
        """Return how far apart two robots are by their states; no two of `posed`.

        only: of these robots.
        """
        from rems_net.recordings.differences import differences

        sources = {name: self._sources[name] for name in only or self}
        if len(sources) < 2 or sources.keys() <= set(posed):
            return []
        driven = [
            self[name]
            for name, (path, agent) in sources.items()
            if self._has_state(name, path, agent)
        ]
        return differences(driven, posed)

    def _has_state(self, name: str, path: Path, agent: str) -> bool:
        if agent:
            return f"{agent}/state" in self.mcap(path).channels
        known = self.like is not None or name in self._read
        columns = self[name].columns() if known else CsvFile(path).columns
        return any(column.name.startswith("state/") for column in columns)

    def why(self, a: str = "", b: str = "") -> "Why":
        """Return where and why robot `b` parts from robot `a`, computed from the files.

        Without `a`, from the kinematic one, or else the first; without `b`, the first
        of the others. Raises UnknownFieldError, and ExperimentError for two that have
        nothing to compare.
        """
        from rems_net.recordings.comparison import reference
        from rems_net.recordings.parting.pair import RobotPair
        from rems_net.recordings.parting.why import why

        names = list(self)
        a = a or reference(names)
        b = b or next((name for name in names if name != a), a)
        others = ", ".join(name for name in names if name != a)
        if a == b:
            raise ExperimentError(
                f"{a} cannot be compared with itself; name another robot, of: "
                f"{others or 'none'}. (R0850)"
            )
        return why(RobotPair(self[a], self[b], (self.start(a), self.start(b))))

    def start(self, robot: str) -> Start | None:
        """Return where a robot started; None if the run has not recorded it."""
        return self.manifest().robots.get(robot)

    def plot(self, *fields: str, path: Path | str | None = None) -> Any:
        """Draw it to `plot.png` in its folder, or to `path`; a notebook shows it.

        Without fields: where the robots drove, how far they were apart, and the rest
        of their state. A field is a column ("sensors/lidar/front"), or what it begins
        with ("sensors"), drawn against time. Raises MissingPartError without
        matplotlib, and ExperimentError for a field that nobody has.
        """
        from rems_net.recordings.plot import plot

        return plot(self, fields, Path(path or self.folder / "plot.png"))

    def animate(
        self, path: Path | str | None = None, *, speed: float = 1.0
    ) -> "Picture":
        """Draw a film of where the robots drive: `film.png` in its folder, or `path`.

        The suffix is the format: .png (animated), .gif, .webp, or .mp4 with ffmpeg.
        speed: seconds of the recording in a second of the film. Raises
        MissingPartError without Pillow, ExperimentError if nothing drives.
        """
        from rems_net.recordings.animation.film import FromAbove, film
        from rems_net.recordings.plot import Picture

        path = Path(path or self.folder / "film.png")
        film(FromAbove(self.trajectories()), self.folder.name, path, speed)
        return Picture(path)


def moved(old: Path, new: Path) -> None:
    """Give the recordings of this process the new name of their folder."""
    for one in list(_open):
        if one.folder == old:
            one.folder = new
            vars(one).pop("_sources", None)
            one.files = [
                new / path.relative_to(old) if path.is_relative_to(old) else path
                for path in one.files
            ]

"""A mapping: what the columns of another program's CSV files mean.

It is a TOML file: `woodbot-class.toml`, beside this file, is one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict import number, parse_quantity
from rems_net.errors import ExperimentError, RemsError, nearest, some, uncoded
from rems_net.recordings.comparison import pose_of, si_factors
from rems_net.recordings.csv_file import Column, CsvFile, heading
from rems_net.recordings.table import Columns, read_columns
from rems_net.system.reading import DESCRIPTION, decoded, read_file
from rems_net.toml import TOMLDecodeError, loads

#: mappings that rems_net has
OURS = {path.stem: path for path in sorted(Path(__file__).parent.glob("*.toml"))}
#: keys of a mapping, of a column in it, and of a frame
KEYS = ("columns", "stamped", "frame", "files")
COLUMN = ("field", "unit", "wrap", "factor")
FRAME = ("ahead", "left", "settled")
STAMPED = ("end", "start")
PORTS = ("command/", "state/", "sensors/")

Values = NDArray[Any]


@dataclass(frozen=True)
class Meaning:
    """Meaning of one column.

    field: `time`, or a path such as `state/x`.  unit: "" for a plain number.
    wrap: whether an angle jumps by a full turn.  factor: of its values; -1 turns a
    sign round.
    """

    field: str
    unit: str = ""
    wrap: bool = False
    factor: float = 1.0


@dataclass(frozen=True)
class Frame:
    """Where the recorded position is in the robot's own frame.

    ahead, left: m, of the recorded point from the origin of the robot.
    settled: row from which its pose counts; two poses are laid over each other there.
    """

    ahead: float = 0.0
    left: float = 0.0
    settled: int = 0


@dataclass(frozen=True)
class Like:
    """A mapping. files: by a pattern of names, what is different in these files."""

    name: str
    columns: Mapping[str, Meaning]
    stamped: str = "end"
    frame: Frame = field(default_factory=Frame)
    files: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def of(self, name: str) -> "Like":
        """Return the mapping for a file of this name. Raises ExperimentError."""
        made = self
        for pattern, more in self.files.items():
            if fnmatch(name, pattern):
                made = _made(f"{self.name}, {pattern!r}", more, made)
        return made

    def read(self, path: Path) -> Columns:
        """Return the columns of a file, as those of our files. Raises ExperimentError.

        A row is stamped at the end of its step, headings are not wrapped, and the
        position is that of the robot's origin.
        """
        mapping = self.of(path.name)
        times = [(n, c.unit) for n, c in mapping.columns.items() if c.field == "time"]
        file = CsvFile(path, time=times[0])
        by_name = {one.name: one for one in file.columns}
        for name in mapping.columns:
            if name not in by_name:
                raise ExperimentError(
                    f"{file.shown}, line 1: expected a column {name!r}, by "
                    f"{mapping.name}; there is {some(by_name)}."
                    f"{nearest(name, by_name)} (R0844)"
                )
        meant = mapping.columns.items()
        wanted = [replace(by_name[name], unit=one.unit) for name, one in meant]
        read = read_columns(file, wanted)
        made: dict[Column, Values] = {}
        for name, one in sorted(meant, key=lambda item: item[1].field != "time"):
            about = len(made), heading(one.field, one.unit), one.field, one.unit
            made[Column(*about)] = _meant(one, read.plain(name))
        time, *_ = made
        seconds = made[time] * parse_quantity(f"1 {time.unit or 's'}", "s")
        if mapping.stamped == "start":
            step = seconds[-1:] - seconds[-2:-1] if len(seconds) > 1 else 0.0
            made[time] = seconds = np.r_[seconds[1:], seconds[-1:] + step]
        _to_origin(mapping.frame, made)
        settled = mapping.frame.settled
        if settled > len(seconds):
            raise ExperimentError(
                f"{file.shown} has {len(seconds)} rows; by {mapping.name} the robot "
                f"settles at row {settled}. (R0844)"
            )
        at = float(seconds[settled - 1]) if settled else None
        return Columns(path.stem, made, seconds, at)


def like(name: str) -> Like:
    """Return a mapping by its name, or from its file. Raises ExperimentError."""
    path = OURS.get(name, Path(name))
    if path.suffix != ".toml":
        raise ExperimentError(
            f"there is no mapping {name!r}; there is {', '.join(OURS)}, or a file of "
            f"your own, such as 'mine.toml'.{nearest(name, OURS)} (R0844)"
        )
    try:
        given = loads(decoded(read_file(path, DESCRIPTION)))
    except FileNotFoundError:
        raise ExperimentError(
            f"there is no mapping in a file {path}; name a TOML file that "
            "is there. (R0844)"
        ) from None
    except OSError as error:
        raise ExperimentError(
            f"cannot read {path}: {error.strerror}. (R0844)"
        ) from None
    except (UnicodeDecodeError, TOMLDecodeError) as error:
        raise ExperimentError(f"{path} is no TOML file: {error}. (R0844)") from None
    made = _made(path.name, given, Like(path.name, {}))
    if not [one for one in made.columns.values() if one.field == "time"]:
        raise ExperimentError(
            f'{path.name}: no column is the time; write such as "t" = {{ field = '
            '"time", unit = "s" }. (R0844)'
        )
    for pattern in made.files:
        made.of(pattern)  # a mistake is found before a file has this name
    return made


def _made(name: str, given: Mapping[str, Any], before: Like) -> Like:
    _known(name, given, KEYS)
    stamped = given.get("stamped", before.stamped)
    if stamped not in STAMPED:
        raise ExperimentError(
            f"{name}: stamped is {stamped!r}; expected 'end' or 'start' of a row's "
            "step. (R0844)"
        )
    columns = dict(before.columns)
    for column, one in _table(name, given, "columns").items():
        columns[column] = _meaning(f"{name}, column {column!r}", one)
    frame = before.frame
    if "frame" in given:
        frame = _frame(f"{name}, frame", _table(name, given, "frame"))
    fields = [one.field for one in columns.values()]
    twice = next((one for one in fields if fields.count(one) > 1), None)
    if twice:
        raise ExperimentError(
            f"{name}: two columns have the field {twice!r}; expected one. Remove the "
            "line of the other. (R0844)"
        )
    files = _table(name, given, "files")
    return Like(name, columns, stamped, frame, files)


def _meaning(where: str, given: object) -> Meaning:
    if not isinstance(given, Mapping) or "field" not in given:
        raise ExperimentError(
            f'{where}: expected such as {{ field = "state/x", unit = "m" }}, but got '
            f"{given!r:.60}. (R0844)"
        )
    _known(where, given, COLUMN)
    try:
        made = Meaning(**given)
        if made.field != "time" and not made.field.startswith(PORTS):
            raise ExperimentError(
                f"its field is {made.field!r}; expected 'time', or a path such as "
                "'state/x', 'command/wheel/left' or 'sensors/gyro'. (R0844)"
            )
        if made.unit not in ("text", "bool"):
            number(made.unit)
        if made.field == "time":
            parse_quantity(f"1 {made.unit or 's'}", "s")
        made.factor * 1.0
    except (RemsError, TypeError, AttributeError) as error:
        raise ExperimentError(f"{where}: {uncoded(error)} (R0844)") from None
    return made


def _frame(where: str, given: Mapping[str, Any]) -> Frame:
    _known(where, given, FRAME)
    try:
        ahead, left = (parse_quantity(given.get(k, 0.0), "m") for k in FRAME[:2])
    except RemsError as error:
        raise ExperimentError(f"{where}: {uncoded(error)} (R0844)") from None
    settled = given.get("settled", 0)
    if type(settled) is not int or settled < 0:
        raise ExperimentError(
            f"{where}: settled is {settled!r}; expected the number of a row, such as "
            "3. (R0844)"
        )
    return Frame(ahead, left, settled)


def _known(where: str, given: Mapping[str, Any], keys: tuple[str, ...]) -> None:
    for key in given:
        if key not in keys:
            raise ExperimentError(
                f"{where}: there is no {key!r}; there is {', '.join(keys)}."
                f"{nearest(key, keys)} (R0844)"
            )


def _table(where: str, given: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = given.get(key, {})
    if not isinstance(found, Mapping):
        raise ExperimentError(
            f"{where}: {key} is {found!r:.60}; expected a table. (R0844)"
        )
    return found


def _meant(one: Meaning, values: Values) -> Values:
    """Return the values of a column, with its factor, and not wrapped."""
    if values.dtype.kind not in "fi":
        return values
    made = values.astype(np.float64) * one.factor
    if one.wrap:
        turn = parse_quantity(f"{2 * np.pi!r} rad", one.unit or "rad")
        made = np.unwrap(made, period=turn)
    return made


def _to_origin(frame: Frame, made: dict[Column, Values]) -> None:
    """Move positions from the recorded point to the robot's origin."""
    columns = pose_of(made)
    if columns is None or not (frame.ahead or frame.left):
        return
    factors = si_factors(columns)
    x, y, heading = (made[column] for column in columns)
    c, s = np.cos(factors[2] * heading), np.sin(factors[2] * heading)
    made[columns[0]] = x - (c * frame.ahead - s * frame.left) / factors[0]
    made[columns[1]] = y - (s * frame.ahead + c * frame.left) / factors[1]

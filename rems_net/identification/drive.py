"""Drive: what a robot was commanded, and where it was, row by row."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rems_net.agents.robot import Robot
from rems_net.defdict import parse_quantity
from rems_net.drivers.kinematic.correction import limits
from rems_net.errors import ExperimentError, some

if TYPE_CHECKING:
    from rems_net.recordings.table import Columns

Floats = NDArray[np.float64]

#: Rows. Fewer show nothing of a parameter.
LEAST = 20


@dataclass(frozen=True)
class Drive:
    """One recording of one robot.

    name: of the robot or file      time: (n,) s, the ends of the steps
    command: by field, (n,), the command that acted until this row's time, as a share
    of the field's limit, or in its own unit if it has none
    state: by field, (n,), in the unit of the schema; only fields that were recorded
    past: what was commanded before, whose effect lasts
    """

    name: str
    time: Floats
    command: dict[str, Floats] = field(repr=False)
    state: dict[str, Floats] = field(repr=False)
    past: "Drive | None" = field(default=None, repr=False)

    def __len__(self) -> int:
        return len(self.time)

    def part(self, rows: slice) -> "Drive":
        """Return some of its rows, which follow each other."""
        first = rows.start or 0
        return Drive(
            self.name,
            self.time[rows],
            {path: values[rows] for path, values in self.command.items()},
            {path: values[rows] for path, values in self.state.items()},
            self.part(slice(0, first)) if first else self.past,
        )


def without(drives: Sequence[Drive], out: Sequence[tuple[int, int]]) -> list[Drive]:
    """Return what is left of drives without these rows; each part is a drive.

    out: first and last row, among the rows of all drives
    """
    left, first = [], 0
    for drive in drives:
        begin, end = 0, first + len(drive)
        for low, high in out:
            if first <= low < end:
                left.append(drive.part(slice(begin, low - first)))
                begin = high + 1 - first
        left.append(drive.part(slice(begin, len(drive))) if begin else drive)
        first = end
    return [drive for drive in left if len(drive) >= LEAST]


def settled(columns: "Columns") -> NDArray[np.intp]:
    """Return the rows that count: from where the robot stands on its wheels."""
    begin = columns.settled if columns.settled is not None else -np.inf
    return np.flatnonzero(np.asarray(columns.seconds(), float) >= begin)


def drive_of(columns: "Columns", definition: Robot) -> Drive:
    """Return the drive in a robot's columns, for this definition.

    definition: with the parameters that it had in the recording, since a command's
    share of full speed counts. Raises ExperimentError if a column of the command or
    the whole state is missing, or if there are too few rows.
    """
    time = np.asarray(columns.seconds(), float)
    rows = settled(columns)
    if len(rows) < LEAST:
        raise ExperimentError(
            f"{columns.name} has {len(rows)} rows; expected at least {LEAST}, which is "
            "2 s at a tick of 0.1 s. Record a longer drive. (R0860)"
        )
    schemas = definition.schemas()
    commanded = schemas["command"]
    most = limits(commanded)
    missing = [p for p, _ in commanded.rows() if f"command/{p}" not in columns]
    state = [p for p, _ in schemas["state"].rows() if f"state/{p}" in columns]
    if missing or not state:
        lacking = [f"command/{path}" for path in missing] or ["state/..."]
        raise ExperimentError(
            f"{columns.name} has no column {some(lacking)}; expected the command and "
            f"the state of {type(definition).__name__}. It has {some(columns)}. (R0861)"
        )
    command = {
        path: share(columns, f"command/{path}", one.unit, most[path])[rows]
        for path, one in commanded.rows()
    }
    found = {
        path: share(columns, f"state/{path}", one.unit, 1.0)[rows]
        for path, one in schemas["state"].rows()
        if path in state
    }
    values = [*command.values(), *found.values()]
    if not all(np.isfinite(one).all() for one in values):
        raise ExperimentError(
            f"{columns.name} has values that are not finite (NaN or infinite). Cut "
            "these rows out of the file. (R0861)"
        )
    return Drive(columns.name, time[rows], command, found)


def share(columns: "Columns", name: str, unit: str, limit: float) -> Floats:
    """Return a column in `unit`, divided by `limit`; percent are a share already."""
    values = np.asarray(columns.plain(name), float)
    given = columns.unit(name)
    if given == "percent" and unit != "percent":
        return values / 100.0
    return values * _factor(given, unit) / limit


def _factor(given: str, unit: str) -> float:
    if given == unit or not given:
        return 1.0
    return float(parse_quantity(f"1 {given}", unit))

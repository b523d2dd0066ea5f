"""Pictures of `rems plot`: the paths of a recording, and its fields against time."""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rems_net.errors import ExperimentError, nearest
from rems_net.recordings.comparison import POSE, compare
from rems_net.recordings.csv_file import TIMES
from rems_net.recordings.manifest import Manifest
from rems_net.recordings.picture import (
    draw_distances,
    draw_headings,
    draw_paths,
    page,
    plain,
    style,
)

if TYPE_CHECKING:
    from rems_net.recordings.recording import Recording
    from rems_net.recordings.table import Columns

#: panels of a picture if no fields are named, and at most
FEW, MOST = 5, 12


class Picture:
    """A picture in the file `path`; a notebook shows it."""

    def __init__(self, path: Path):
        self.path = path

    def __repr__(self) -> str:
        return f"<picture in {self.path}>"

    def __fspath__(self) -> str:
        return str(self.path)

    def _repr_png_(self) -> bytes:
        return self.path.read_bytes()


def plot(recording: "Recording", fields: Sequence[str], path: Path) -> Picture:
    """Draw a recording; see `Recording.plot`."""
    title = recording.folder.name
    drove = [] if fields else recording.trajectories()
    posed = {one.name for one in drove}
    # Robots with a path come first, so that they have one colour in all panels.
    ordered = sorted(recording, key=lambda name: name not in posed)
    robots = [recording[name] for name in ordered]
    told, pairs = recording.manifest(), compare(drove)
    special = bool(pairs) + bool(drove)
    if fields:
        panels = _asked(robots, fields)
    else:
        panels = [h for h in _of_state(robots, posed) if _drawable(robots, h)]
        panels = panels[: FEW - special]
    if not panels and not drove:
        raise ExperimentError(
            f"no robot in {recording.folder} has a state that can be drawn; name a "
            f"field, such as one of {', '.join(_columns(robots))}. (R0845)"
        )
    count = special + len(panels)
    robots = _drawn(robots, posed, panels)
    names = [robot.name for robot in robots]
    with page(path, title, names, paths=bool(drove), panels=count) as (left, right):
        if drove:
            draw_paths(left, drove)
            draw_headings(right[special - 1], drove)
        if pairs:
            draw_distances(right[0], [one.name for one in drove], pairs)
        for axes, heading in zip(right[special:], panels, strict=True):
            _draw_field(axes, heading, robots, told)
    return Picture(path)


def _drawn(
    robots: "Sequence[Columns]", posed: Collection[str], panels: Sequence[str]
) -> "list[Columns]":
    """Return the robots that appear in the picture."""
    return [
        r for r in robots if r.name in posed or not r.table.keys().isdisjoint(panels)
    ]


def _columns(robots: "Sequence[Columns]") -> list[str]:
    """Return the names of all columns but the time, each once."""
    return list(dict.fromkeys(n for robot in robots for n in robot if n not in TIMES))


def _asked(robots: "Sequence[Columns]", fields: Sequence[str]) -> list[str]:
    """Return the headings that are named, or that begin with a name."""
    found: list[str] = []
    for field in fields:
        under = tuple(field.rstrip("/") + mark for mark in "/[ ")
        these = [
            heading
            for robot in robots
            for heading in robot.table
            if f"{heading} ".startswith(under)
        ]
        known = _columns(robots)
        if not these:
            raise ExperimentError(
                f"no robot of this recording has {field!r}; there is "
                f"{', '.join(known)}.{nearest(field, known)} (R0841)"
            )
        drawn = [heading for heading in these if _drawable(robots, heading)]
        if not drawn:
            raise ExperimentError(
                f"{field!r} is text, which cannot be drawn; name a field "
                "of numbers, such as state/x. (R0845)"
            )
        found += drawn
    found = list(dict.fromkeys(found))
    if len(found) > MOST:
        raise ExperimentError(
            f"that is {len(found)} fields, and a picture has room for {MOST}; name "
            "fewer. (R0845)"
        )
    return found


def _of_state(robots: "Sequence[Columns]", posed: set[str]) -> list[str]:
    """Return the headings of the state, without a pose whose path is drawn."""
    pose = {name for name, _ in POSE}
    return list(
        dict.fromkeys(
            column.heading
            for robot in robots
            for column in robot.columns()
            if column.name.startswith("state")
            and not (robot.name in posed and column.name in pose)
        )
    )


def _drawable(robots: "Sequence[Columns]", heading: str) -> bool:
    kinds = {r.table[heading].dtype.kind for r in robots if heading in r.table}
    return "U" not in kinds


def _draw_field(
    axes: Any, heading: str, robots: "Sequence[Columns]", told: Manifest
) -> None:
    """Draw one field of all robots that have it, from the start."""
    name, bracket, unit = heading.partition(" [")
    plain(axes, name, "time [s]", name.rpartition("/")[2] + bracket + unit)
    # A command holds for all of its step.
    how = {"drawstyle": "steps-pre"} if name.startswith("command") else {}
    for i, robot in enumerate(robots):
        if heading in robot.table:
            time, values = robot.seconds(), robot.table[heading].astype(float)
            start = told.robots.get(robot.name)
            if start is not None and heading in start.state:
                time = np.concatenate(([start.time], time))
                values = np.concatenate(([start.state[heading]], values))
            axes.plot(time, values, **style(i, len(robots)), **how)

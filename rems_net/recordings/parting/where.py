"""Where two robots part: time, place, command, and things near them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.parting.pair import RobotPair
from rems_net.recordings.parting.trajectory import Array, Drive, StepTrajectory

#: m. A distance sensor that reads less has something near it.
CLOSE = 0.05
LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
#: s. Duration over which the growth of a difference is measured.
GROWS = 1.0


@dataclass(frozen=True)
class Where:
    """Time of the parting, and the situation then.

    time: s, when the difference first exceeded `limit`
    heading: whether this is a difference of headings, of poses that are near each other
    limit, most, rate: of the difference, and its growth per second after `time`
    latest: s, when the difference was largest
    off (size,): the difference at `time`; of a pose ahead, to the left, turned
    place (size,): position of the second robot      command: its command, by field
    near: things near it, from its sensors and the wall of its arena
    """

    time: float
    heading: bool
    limit: float
    most: float
    latest: float
    rate: float
    off: Array
    place: Array
    command: dict[str, tuple[float, str]]
    near: Sequence[str]


def where(both: RobotPair, a: StepTrajectory, b: StepTrajectory, limit: float) -> Where:
    """Find when the difference first exceeds `limit`, or half of its maximum."""
    off = b.points - a.points
    apart = np.linalg.norm(off[:, : 2 if a.turns else 1], axis=1)
    turned = np.abs(off[:, -1])
    near_by = bool(a.turns) and apart.max() <= limit
    heading = near_by and bool(turned.max() * a.weights()[-1] > apart.max())
    if heading:
        apart, limit = turned, 0.0
    most = float(apart.max())
    limit = limit if 0 < limit < most else most / 2
    k = int(np.argmax(apart > limit)) if most > 0 else 0
    time = float(a.time[k])
    soon = slice(k, np.searchsorted(a.time, time + GROWS, side="right"))
    rate = 0.0
    if len(a.time[soon]) > 1:
        rate = float(np.polyfit(a.time[soon] - time, apart[soon], 1)[0])
    then = off[k]
    if isinstance(a, Drive):
        x, y, turn = then
        c, s = np.cos(a.points[k, 2]), np.sin(a.points[k, 2])
        then = np.array([c * x + s * y, c * y - s * x, turn])
    row = int(np.searchsorted(both.time, time))
    told = {
        name.removeprefix("command/"): (float(both.of(both.b, name)[row]), unit)
        for name, unit in ((n, both.b.unit(n)) for n in both.b)
        if name.startswith("command/") and both.b.plain(name).dtype.kind in "fi"
    }
    rows = np.zeros(len(both.time), bool)
    rows[row] = True
    latest, seen = float(a.time[int(apart.argmax())]), near(both, 1, rows)
    sizes = limit, most, latest, rate
    return Where(time, heading, *sizes, then, b.points[k], told, seen)


def near(both: RobotPair, which: int, rows: NDArray[np.bool_]) -> list[str]:
    """Return the things near one of the two in these rows, by its recording."""
    robot = (both.a, both.b)[which]
    found = []
    for name in (name for name in robot if name.startswith("sensors/")):
        values, here = robot.plain(name), both.of(robot, name)[rows]
        short, size = name.removeprefix("sensors/"), LENGTHS.get(robot.unit(name))
        if values.dtype.kind == "b" and here.mean() > 0.5 > values.mean():
            found.append(f"{short} is on")
        elif values.dtype.kind == "f" and size is not None:
            least = float(here.min()) * size
            found += [f"{short} reads {1e3 * least:.0f} mm"] if least < CLOSE else []
    if both.posed and both.arena:
        pose = both.drives()[which].points[-len(both.time) :]
        if np.hypot(pose[rows, 0], pose[rows, 1]).max() > both.arena:
            found.insert(0, "beyond the wall of its arena")
    return found

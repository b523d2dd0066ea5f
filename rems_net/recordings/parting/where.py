"""Where two robots part: when, at which place, told what, and what was near."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.parting.both import Both
from rems_net.recordings.parting.course import Array, Course, Drive

#: m: what a ray reads where something is near
CLOSE = 0.05
LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
#: s: over so long it is looked how fast a difference grows
GROWS = 1.0


@dataclass(frozen=True)
class Where:
    """When they part, and what was there then.

    time: s, when the difference was first more than `limit`
    heading: whether that is one of headings, of poses that are near each other
    limit, most, rate: of the difference, which then grew so fast per second
    latest: s, when it was most
    off (size,): what was different at that time; of a pose ahead, to the left, turned
    place (size,): where the second one was      command: by field, what that was told
    near: what its sensors, and the wall of its arena, say of things there
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


def where(both: Both, a: Course, b: Course, limit: float) -> Where:
    """Look when the difference is first more than this, or half of the most it is."""
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


def near(both: Both, which: int, rows: NDArray[np.bool_]) -> list[str]:
    """What the recording of one of the two says of things near it, in these rows."""
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

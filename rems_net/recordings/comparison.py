"""Distance of two-wheeled robots, from the files of a run."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict import parse_quantity
from rems_net.errors import RemsError
from rems_net.recordings.common import Common, common, interpolated, laid_at, lay
from rems_net.recordings.csv_file import Column, CsvFile
from rems_net.recordings.manifest import Manifest
from rems_net.recordings.table import Columns, read_columns

Array = NDArray[np.float64]

#: robots. If there are more, a report is on the first of them, and each is compared
#: with the reference robot only.
CROWD = 30
#: m. Two robots have parted if they are further apart than this.
APART = 0.010
#: any unit. A robot with a larger value has run away: only the rows before are
#: compared.
FAR = 1e50
#: The first three fields of a two-wheeled robot's state, with their SI units.
POSE = (("state/x", "m"), ("state/y", "m"), ("state/heading", "rad"))


@dataclass(frozen=True)
class Trajectory:
    """Trajectory of one robot: time (n,) s; x, y (n,) m; heading (n,) rad.

    start: time, x, y and heading before its first step, if known
    arena: radius of the round wall about the origin, m; 0 for none
    outline: corners (k, 2) of the robot in its own frame, m; none if unknown
    around: corners (k, 2) of the things in its world at the start, by name
    settled: s, the time from which its pose counts; None if it does from the start
    """

    name: str
    time: Array
    x: Array
    y: Array
    heading: Array
    start: tuple[float, float, float, float] | None = None
    arena: float = 0.0
    outline: Array = field(default_factory=lambda: np.zeros((0, 2)))
    around: Mapping[str, Array] = field(default_factory=dict)
    settled: float | None = None

    def drawn(self) -> tuple[Array, Array, Array, Array]:
        """Return time, x, y and heading (unwrapped), from the start on."""
        rows = np.stack((self.time, self.x, self.y, self.heading))
        if self.start is not None:
            rows = np.column_stack((self.start, rows))
        return rows[0], rows[1], rows[2], np.unwrap(rows[3])


@dataclass(frozen=True, repr=False)
class Pair:
    """Distance of robot `b` from robot `a`, at common times.

    time (n,) s        distance (n,) m
    turn (n,) rad: heading of b minus heading of a, not wrapped
    hidden: m, what the distance can be off by, if poses are interpolated; else 0
    laid: s, the time at which `b` was laid over `a`; None if it was not
    """

    a: str
    b: str
    time: Array
    distance: Array
    turn: Array
    hidden: float = 0.0
    laid: float | None = None

    @property
    def rms(self) -> float:
        """Root of the mean square of the distance, m."""
        return _rms(self.distance)

    @property
    def final(self) -> float:
        """Distance at the last common time, m."""
        return float(self.distance[-1])

    @property
    def rms_turn(self) -> float:
        """Root of the mean square of the difference of heading, rad."""
        return _rms(self.turn)

    @property
    def final_turn(self) -> float:
        """Difference of heading at the last common time, rad; b further left is +."""
        return float(self.turn[-1])

    @property
    def parted(self) -> float | None:
        """First time at which they were more than 10 mm apart, s; None for never."""
        apart = np.flatnonzero(self.distance > APART)
        return float(self.time[apart[0]]) if len(apart) else None

    def __repr__(self) -> str:
        when = "never" if self.parted is None else f"at {self.parted:g} s"
        return (
            f"{self.a} - {self.b}: {1e3 * self.rms:.2f} mm apart (rms), "
            f"{1e3 * self.final:.2f} mm at the end; more than 10 mm: {when}"
            f"{self.remark}"
        )

    @property
    def remark(self) -> str:
        """How their times and their poses were made comparable; "" if they were."""
        laid = "" if self.laid is None else f"; laid over each other at {self.laid:g} s"
        return laid + interpolated(self.hidden, "m")


def corners(text: str) -> Array:
    """Return the corners (k, 2) of an outline, m; none if it is malformed."""
    try:
        pairs = [[float(x) for x in pair.split(",")] for pair in text.split()]
        return np.array(pairs, dtype=np.float64).reshape(-1, 2)
    except (ValueError, TypeError, AttributeError):
        return np.zeros((0, 2))


def trajectory_of(columns: Columns, told: Manifest) -> Trajectory | None:
    """Return where a robot was, from its columns; None if they have no pose.

    told: of its run. If the robot runs away, only the rows before are kept.
    """
    pose = pose_of(columns.columns())
    if pose is None:
        return None
    states = np.stack([columns.plain(one.name) for one in pose])
    near = until_far(states)
    if not near:
        return None
    factors, time = si_factors(pose), columns.seconds()[:near]
    x, y, heading = factors[:, None] * states[:, :near]
    made = Trajectory(columns.name, time, x, y, heading, settled=columns.settled)
    start = told.robots.get(columns.name)
    if start is None:
        return made
    before = None
    if all(one.heading in start.state for one in pose):
        x, y, heading = factors * [start.state[one.heading] for one in pose]
        before = start.time, x, y, heading
    things = told.worlds.get(start.world, {})
    return replace(
        made,
        start=before,
        arena=start.arena,
        outline=corners(start.outline),
        around={name: corners(text) for name, text in things.items()},
    )


def read_pose(path: Path) -> Columns | None:
    """Return only x, y and heading of a CSV file; None if it does not have them.

    Raises ExperimentError if it is not a CSV file of a run.
    """
    file = CsvFile(path)
    pose = pose_of(file.columns)
    return None if pose is None else read_columns(file, pose)


def until_far(columns: Array) -> int:
    """Return how many rows of columns (k, n) come before the first one beyond FAR."""
    far = np.flatnonzero((np.abs(columns) > FAR).any(axis=0))
    return int(far[0]) if len(far) else columns.shape[1]


def pose_of(columns: Iterable[Column]) -> list[Column] | None:
    """Return the columns x, y and heading if the state begins with them, else None."""
    states = [c for c in columns if c.name.startswith("state/")][: len(POSE)]
    if [c.name for c in states] != [name for name, _ in POSE]:
        return None
    units = zip(states, POSE, strict=True)
    known = (unit_factor(c.unit, unit) is not None for c, (_, unit) in units)
    # if its x is not a length, it is another robot
    return states if all(known) else None


def si_factors(pose: Iterable[Column]) -> Array:
    """Return the factors (3,) from the units of x, y and heading to m and rad."""
    units = zip(pose, POSE, strict=True)
    return np.array([unit_factor(one.unit, unit) for one, (_, unit) in units])


def factor(a: Columns, b: Columns, field: str) -> float | None:
    """Return the factor from the unit of `b` to that of `a`; None if not comparable."""
    if field not in a or field not in b:
        return None
    if any(one.plain(field).dtype.kind not in "fi" for one in (a, b)):
        return None
    return unit_factor(b.unit(field), a.unit(field))


def unit_factor(unit: str, wanted: str) -> float | None:
    """Return the factor from one unit to another; None for another quantity."""
    if unit == wanted:
        return 1.0
    try:
        return parse_quantity(f"1 {unit}".strip(), wanted)
    except RemsError:
        return None


def compare(robots: Sequence[Trajectory]) -> list[Pair]:
    """Compare each two robots that have common times.

    Of more than CROWD robots each is compared with the reference robot only.
    """
    found = []
    if len(robots) <= CROWD:
        couples = [*combinations(robots, 2)]
    else:
        first = reference([one.name for one in robots])
        a = next(one for one in robots if one.name == first)
        couples = [(a, b) for b in robots if b is not a]
    for a, b in couples:
        both = common(a.time, b.time)
        if len(both.time):
            one, other = (_at(both, k, robot) for k, robot in enumerate((a, b)))
            laid = laid_at(a.settled, b.settled)
            if laid is not None:
                other = lay(other, one, int(np.argmin(np.abs(both.time - laid))))
            off = other - one
            distance, turn = np.hypot(off[:, 0], off[:, 1]), np.unwrap(off[:, 2])
            hidden = max(_hidden(both, 0, a), _hidden(both, 1, b))
            pair = a.name, b.name, both.time, distance, turn, hidden
            found.append(Pair(*pair, laid))
    return found


def reference(names: Sequence[str]) -> str:
    """Return the reference robot: the kinematic one, else the first."""
    return next((name for name in names if "kinematic" in name), names[0])


def _at(both: Common, k: int, robot: Trajectory) -> Array:
    """Return the poses (n, 3) of a robot at common times."""
    heading = robot.heading if both.rows is not None else np.unwrap(robot.heading)
    parts = [both.of(k, v, holds=False) for v in (robot.x, robot.y, heading)]
    return np.stack(parts, axis=1)


def _hidden(both: Common, k: int, robot: Trajectory) -> float:
    return float(np.hypot(both.hidden(k, robot.x), both.hidden(k, robot.y)))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))

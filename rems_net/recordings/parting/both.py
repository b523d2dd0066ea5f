"""What two robots have recorded, side by side: at the times, in the units of one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.comparison import (
    POSE,
    factor,
    pose_of,
    unit_factor,
    until_far,
)
from rems_net.recordings.manifest import Start
from rems_net.recordings.parting.course import Array, Course, Drive

if TYPE_CHECKING:
    from rems_net.recordings.table import Columns


class Both:
    """Columns of robots `a` and `b` at the times (n,) s that both have.

    starts: of each, where the run has left word of it
    """

    def __init__(self, a: Columns, b: Columns, starts: tuple[Start | None, ...]):
        self.a, self.b = a, b
        self.time, i, j = np.intersect1d(a.seconds(), b.seconds(), return_indices=True)
        self._rows = i, j
        #: what ends the rows that are compared, such as "state/x of a is 1e+60 m"
        self.far = self._cut()
        known = [one for one in starts if one is not None]
        #: of both, or of neither: one alone would be a step that nobody took
        self._starts = known if len(known) == 2 else []

    def _cut(self) -> str:
        """Leave out what comes after one of both has run away; return what did."""
        rows, said = len(self.time), ""
        for field in (one for one in self.a if self.factor(one) is not None):
            for robot, values in zip(
                (self.a, self.b), self.numbers(field), strict=True
            ):
                if (near := until_far(values[None, :rows])) < rows:
                    rows, value = near, self.of(robot, field)[near]
                    unit = f" {robot.unit(field)}" * bool(robot.unit(field))
                    when = f"at {self.time[near]:g} s"
                    said = f"{field} of {robot.name} is {value:.3g}{unit} {when}"
        i, j = self._rows
        self.time, self._rows = self.time[:rows], (i[:rows], j[:rows])
        return said

    def fields(self, port: str) -> Iterator[str]:
        """The fields of a port that both have, in numbers of one kind."""
        for name in self.a:
            if name.partition("/")[0] == port and self.factor(name) is not None:
                yield name

    def factor(self, field: str) -> float | None:
        """What makes the field of `b` one of `a`; None where they can't be compared."""
        return factor(self.a, self.b, field)

    def numbers(self, field: str) -> tuple[Array, Array]:
        """Of both (n,), in the unit of `a`."""
        factor = self.factor(field)
        assert factor is not None
        one, other = self.of(self.a, field), self.of(self.b, field)
        return one.astype(float), factor * other.astype(float)

    def of(self, robot: Columns, field: str) -> NDArray[np.generic]:
        """A column of one of the two at these times (n,)."""
        return robot.plain(field)[self._rows[robot is self.b]]

    @property
    def posed(self) -> bool:
        """Whether both have x, y and heading, first of their states."""
        return all(pose_of(one.columns()) for one in (self.a, self.b))

    def drives(self) -> tuple[Course, Course]:
        """Their poses, in m and rad."""
        made = []
        for k, robot in enumerate((self.a, self.b)):
            factors = [
                unit_factor(robot.unit(name), unit) or 1.0 for name, unit in POSE
            ]
            names = [name for name, _ in POSE]
            time, points = self._from_start(k, robot, names)
            points = points * factors
            points[:, 2] = np.unwrap(points[:, 2])
            made.append(Drive(time, points))
        one, other = made
        # Full turns between them are nobody's error.
        whole = np.round((other.points[0, 2] - one.points[0, 2]) / (2 * np.pi))
        return one, Drive(other.time, other.points - (0.0, 0.0, 2 * np.pi * whole))

    def courses(self, field: str) -> tuple[Course, Course]:
        """One field of their states, in the unit of `a`."""
        factor = self.factor(field)
        assert factor is not None
        one = Course(*self._from_start(0, self.a, [field]))
        time, points = self._from_start(1, self.b, [field])
        return one, Course(time, factor * points)

    def _from_start(
        self, k: int, robot: Columns, names: Sequence[str]
    ) -> tuple[Array, Array]:
        points = np.stack([self.of(robot, n).astype(float) for n in names], axis=1)
        if not self.started(names):
            return self.time, points
        start = self._starts[k]
        first = [start.state[robot.heading(name)] for name in names]
        return np.r_[start.time, self.time], np.r_[[first], points]

    def started(self, names: Sequence[str]) -> bool:
        """Whether it is known where both started in these fields."""
        robots = zip(self._starts, (self.a, self.b), strict=False)
        return bool(self._starts) and all(
            robot.heading(name) in start.state
            for start, robot in robots
            for name in names
        )

    @property
    def arena(self) -> float:
        """Radius of the round wall about both, m; 0 for none, or for two of them."""
        radii = {one.arena for one in self._starts}
        return radii.pop() if len(radii) == 1 else 0.0

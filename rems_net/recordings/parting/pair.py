"""Recordings of two robots at common times, in the units of the first."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.common import DIGITS, common, laid_at, lay
from rems_net.recordings.comparison import factor, pose_of, si_factors, until_far
from rems_net.recordings.manifest import Start
from rems_net.recordings.parting.trajectory import Array, Drive, StepTrajectory

if TYPE_CHECKING:
    from rems_net.recordings.table import Columns


class RobotPair:
    """Columns of robots `a` and `b` at the times (n,) s that both have.

    starts: of each robot, if the run has recorded it
    """

    def __init__(self, a: "Columns", b: "Columns", starts: tuple[Start | None, ...]):
        self.a, self.b = a, b
        self._common = common(a.seconds(), b.seconds())
        laid = laid_at(a.settled, b.settled)
        if laid is not None:  # before that their poses do not count
            first = int(np.searchsorted(self.time, laid - 10**-DIGITS))
            self._common = self._common.part(slice(first, None))
        #: why the compared rows end, such as "state/x of a is 1e+60 m"
        self.far = self._cut()
        known = [one for one in starts if one is not None]
        #: of both, or of neither: one start alone would look like a step
        self._starts = known if len(known) == 2 else []

    def _cut(self) -> str:
        """Drop the rows after one robot has run away; return which value did."""
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
        self._common = self._common.part(slice(rows))
        return said

    @property
    def time(self) -> Array:
        """The compared times (n,), s."""
        return self._common.time

    def fields(self, port: str) -> Iterator[str]:
        """Yield the comparable fields of a port that both have."""
        for name in self.a:
            if name.partition("/")[0] == port and self.factor(name) is not None:
                yield name

    def factor(self, field: str) -> float | None:
        """Return the factor from the unit of `b` to that of `a`; None for none."""
        return factor(self.a, self.b, field)

    def numbers(self, field: str) -> tuple[Array, Array]:
        """Return the values of both (n,), in the unit of `a`."""
        factor = self.factor(field)
        assert factor is not None
        one, other = self.of(self.a, field), self.of(self.b, field)
        return one.astype(float), factor * other.astype(float)

    def of(self, robot: "Columns", field: str) -> NDArray[np.generic]:
        """Return a column of one robot at these times (n,)."""
        holds = not field.startswith("state/")
        return self._common.of(int(robot is self.b), robot.plain(field), holds=holds)

    @property
    def posed(self) -> bool:
        """Whether the state of both begins with x, y and heading."""
        return all(pose_of(one.columns()) for one in (self.a, self.b))

    def drives(self) -> tuple[StepTrajectory, StepTrajectory]:
        """Return the poses of both, in m and rad."""
        made = []
        for k, robot in enumerate((self.a, self.b)):
            pose = pose_of(robot.columns()) or []
            time, points = self._from_start(k, robot, [one.name for one in pose])
            points = points * si_factors(pose)
            points[:, 2] = np.unwrap(points[:, 2])
            made.append(Drive(time, points))
        one, other = made
        if laid_at(self.a.settled, self.b.settled) is not None:
            other = Drive(other.time, lay(other.points, one.points, 0))
        # A difference of full turns is no difference.
        whole = np.round((other.points[0, 2] - one.points[0, 2]) / (2 * np.pi))
        return one, Drive(other.time, other.points - (0.0, 0.0, 2 * np.pi * whole))

    def trajectories(self, field: str) -> tuple[StepTrajectory, StepTrajectory]:
        """Return one field of both states, in the unit of `a`."""
        factor = self.factor(field)
        assert factor is not None
        one = StepTrajectory(*self._from_start(0, self.a, [field]))
        time, points = self._from_start(1, self.b, [field])
        return one, StepTrajectory(time, factor * points)

    def _from_start(
        self, k: int, robot: "Columns", names: Sequence[str]
    ) -> tuple[Array, Array]:
        points = np.stack([self.of(robot, n).astype(float) for n in names], axis=1)
        if not self.started(names):
            return self.time, points
        start = self._starts[k]
        first = [start.state[robot.heading(name)] for name in names]
        return np.r_[start.time, self.time], np.r_[[first], points]

    def started(self, names: Sequence[str]) -> bool:
        """Return whether the start of both is known in these fields."""
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

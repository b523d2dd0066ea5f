"""Courses: where a robot was, as a start and steps that can be changed and redone."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: m: a heading counts as much as the way to the side that it makes at this distance,
#: or at the spread of the course, which is mostly more
NEAR = 0.05


@dataclass(frozen=True)
class Course:
    """One number over time, such as the angle of a joint.

    time (n + 1,) s     points (n + 1, size)
    A step (size,) leads from a point to the next one.
    """

    time: Array
    points: Array
    #: what a step is made of; those that are a way, those that are a turn
    size: ClassVar[int] = 1
    ways: ClassVar[tuple[int, ...]] = (0,)
    turns: ClassVar[tuple[int, ...]] = ()

    def steps(self) -> Array:
        """How it goes on from each point, (n, size)."""
        found: Array = np.diff(self.points, axis=0)
        return found

    def led(self, start: Array, steps: Array) -> Array:
        """Where these steps lead from there: points (n + 1, size)."""
        sums = np.concatenate((np.zeros((1, self.size)), steps.cumsum(axis=0)))
        found: Array = start + sums
        return found

    def weights(self) -> Array:
        """What differences of the coordinates count, (size,)."""
        return np.ones(1)

    def dt(self) -> Array:
        """How long each step lasts, (n, 1) s."""
        found: Array = np.diff(self.time)[:, None]
        return found


@dataclass(frozen=True)
class Drive(Course):
    """A pose over time: x and y in m, heading in rad, not wrapped.

    A step goes ahead and to the left (m), by the heading in its middle, and turns
    (rad): what wheels do, wherever the robot is.
    """

    size: ClassVar[int] = 3
    ways: ClassVar[tuple[int, ...]] = (0, 1)
    turns: ClassVar[tuple[int, ...]] = (2,)

    def steps(self) -> Array:
        """How it goes on from each point, (n, 3): ahead, left, turned."""
        x, y, turn = np.diff(self.points, axis=0).T
        middle = self.points[:-1, 2] + turn / 2
        c, s = np.cos(middle), np.sin(middle)
        return np.stack((c * x + s * y, c * y - s * x, turn), axis=1)

    def led(self, start: Array, steps: Array) -> Array:
        """Where these steps lead from there: points (n + 1, 3)."""
        ahead, left, turn = steps.T
        middle = start[2] + turn.cumsum() - turn / 2
        c, s = np.cos(middle), np.sin(middle)
        moves = np.stack((c * ahead - s * left, s * ahead + c * left, turn), axis=1)
        found: Array = start + np.concatenate((np.zeros((1, 3)), moves.cumsum(axis=0)))
        return found

    def weights(self) -> Array:
        """What differences of the coordinates count, (3,): a heading as m."""
        spread = self.points[:, :2].std(axis=0)
        return np.array([1.0, 1.0, max(NEAR, float(np.hypot(*spread)))])


def late(points: Array, time: Array, delay: float) -> Array:
    """The points of one so much later, s: it stood before, and goes on after."""
    lasts = time[-1:] - time[-2:-1]
    beyond = points[-1:] + (points[-1:] - points[-2:-1]) * abs(delay) / lasts
    times = np.concatenate((time, time[-1:] + max(abs(delay), 1e-9)))
    columns = np.concatenate((points, beyond)).T
    found = [np.interp(time - delay, times, column) for column in columns]
    return np.stack(found, axis=1)

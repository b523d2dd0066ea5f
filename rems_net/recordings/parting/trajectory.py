"""Trajectories: positions of a robot, as a start and steps that can be changed."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: m. Lever that turns a difference of heading into a length, if the spread of the
#: trajectory is not larger.
NEAR = 0.05


@dataclass(frozen=True)
class StepTrajectory:
    """Values of one robot in the order of time, with the place of each.

    time: s, (n,)      points: (n, size), in SI units
    """

    time: Array
    points: Array
    #: number of coordinates of a step; indices of the lengths and of the angles
    size: ClassVar[int] = 1
    ways: ClassVar[tuple[int, ...]] = (0,)
    turns: ClassVar[tuple[int, ...]] = ()

    def steps(self) -> Array:
        """Return the step from each point to the next, (n, size)."""
        found: Array = np.diff(self.points, axis=0)
        return found

    def led(self, start: Array, steps: Array) -> Array:
        """Return the points that these steps reach, (n + 1, size)."""
        sums = np.concatenate((np.zeros((1, self.size)), steps.cumsum(axis=0)))
        found: Array = start + sums
        return found

    def weights(self) -> Array:
        """Return the weight of each coordinate's difference, (size,)."""
        return np.ones(1)

    def dt(self) -> Array:
        """Return the duration of each step, (n, 1) s."""
        found: Array = np.diff(self.time)[:, None]
        return found


@dataclass(frozen=True)
class Drive(StepTrajectory):
    """A pose over time: x and y in m, heading in rad, not wrapped.

    A step is a movement ahead and to the left (m), relative to the heading at its
    middle, and a turn (rad): it depends on the wheels, not on where the robot is.
    """

    size: ClassVar[int] = 3
    ways: ClassVar[tuple[int, ...]] = (0, 1)
    turns: ClassVar[tuple[int, ...]] = (2,)

    def steps(self) -> Array:
        """Return the steps from each point, (n, 3): ahead, left, turn."""
        x, y, turn = np.diff(self.points, axis=0).T
        middle = self.points[:-1, 2] + turn / 2
        c, s = np.cos(middle), np.sin(middle)
        return np.stack((c * x + s * y, c * y - s * x, turn), axis=1)

    def led(self, start: Array, steps: Array) -> Array:
        """Return the points that these steps reach, (n + 1, 3)."""
        ahead, left, turn = steps.T
        middle = start[2] + turn.cumsum() - turn / 2
        c, s = np.cos(middle), np.sin(middle)
        moves = np.stack((c * ahead - s * left, s * ahead + c * left, turn), axis=1)
        found: Array = start + np.concatenate((np.zeros((1, 3)), moves.cumsum(axis=0)))
        return found

    def weights(self) -> Array:
        """Return the weights of the coordinates, (3,); that of a heading in m."""
        spread = self.points[:, :2].std(axis=0)
        return np.array([1.0, 1.0, max(NEAR, float(np.hypot(*spread)))])


def late(points: Array, time: Array, delay: float) -> Array:
    """Return the points `delay` s later: at rest before, extrapolated after."""
    lasts = time[-1:] - time[-2:-1]
    beyond = points[-1:] + (points[-1:] - points[-2:-1]) * abs(delay) / lasts
    times = np.concatenate((time, time[-1:] + max(abs(delay), 1e-9)))
    columns = np.concatenate((points, beyond)).T
    found = [np.interp(time - delay, times, column) for column in columns]
    return np.stack(found, axis=1)

"""A stage: where robots and things are in a picture, seen from above."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.comparison import Trajectory

Array = NDArray[np.float64]

#: m. Half of the length of a robot whose outline is not known.
SIZE = 0.05
#: fraction of the height of the picture, around what moves
MARGIN = 0.08
#: ratio. A wall this many times further away than any robot drove is not shown.
FAR = 5.0


@dataclass(frozen=True)
class Stage:
    """Where things are in a picture of some size (width, height), in pixels.

    x is to the right and y up, both in m; all robots are inside at all times.
    """

    size: tuple[int, int]
    middle: tuple[float, float]
    #: pixels per m
    scale: float

    def at(self, points: Array) -> list[tuple[float, float]]:
        """Return the places (n, 2) of points (n, 2) in m, in pixels."""
        width, height = self.size
        x = width / 2 + (points[:, 0] - self.middle[0]) * self.scale
        y = height / 2 - (points[:, 1] - self.middle[1]) * self.scale
        return list(zip(x.tolist(), y.tolist(), strict=True))


def stage(robots: Sequence[Trajectory], size: tuple[int, int]) -> Stage:
    """Return a stage on which all robots have room."""
    points, reach = [], 0.0
    for robot in robots:
        _, x, y, _ = robot.drawn()
        points.append(np.stack((x, y), axis=1))
        reach = max(reach, float(np.hypot(*outline(robot).T).max()))
    every = np.concatenate(points)
    far = float(np.hypot(*every.T).max()) + reach
    arena = max((one.arena for one in robots if one.arena <= FAR * far), default=0.0)
    low = np.minimum(every.min(axis=0) - reach, -arena)
    high = np.maximum(every.max(axis=0) + reach, arena)
    width, height = size
    room = np.array([width, height]) * (1 - 2 * MARGIN)
    scale = float((room / np.maximum(high - low, 1e-9)).min())
    x, y = (low + high) / 2
    return Stage(size, (float(x), float(y)), scale)


def things(robots: Sequence[Trajectory]) -> list[tuple[str, Array]]:
    """Return name and corners (k, 2) of the things around robots, each once.

    Larger ones come first: smaller ones, such as a ball on a ramp, are drawn over them.
    """
    found = {
        (name, corners.tobytes()): (name, corners)
        for robot in robots
        for name, corners in robot.around.items()
        if len(corners) > 2
    }
    return sorted(found.values(), key=lambda one: -float(np.prod(np.ptp(one[1], 0))))


def outline(robot: Trajectory) -> Array:
    """Return the corners (k, 2) of a robot, m; of an unknown one, an arrow."""
    if len(robot.outline):
        return robot.outline
    return SIZE * np.array([[1.0, 0.0], [-1.0, 0.7], [-0.6, 0.0], [-1.0, -0.7]])


def placed(corners: Array, x: float, y: float, heading: float) -> Array:
    """Return corners (k, 2) of a robot's own frame in that of the world."""
    s, c = np.sin(heading), np.cos(heading)
    return np.asarray(corners @ [[c, s], [-s, c]] + (x, y))


def circle(radius: float) -> Array:
    """Return points (n, 2) of a circle about the origin."""
    turn = np.linspace(0, 2 * np.pi, 181)
    return radius * np.stack((np.cos(turn), np.sin(turn)), axis=1)

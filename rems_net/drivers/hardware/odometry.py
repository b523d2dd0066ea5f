"""Odometry: a robot's pose from the counts of its two wheels' encoders."""

from collections.abc import Iterable, Mapping
from math import pi
from typing import Any

from rems_net.maths import sincos


class Odometer:
    """Pose of a robot. Lengths in m, angles in rad, counter-clockwise, not wrapped.

    counts: per turn of a wheel      wrap: counts after which an encoder starts again
    """

    def __init__(self, wheel_radius: float, track: float, counts: float, wrap: int):
        self._radius, self._track = wheel_radius, track
        self._count, self._wrap = 2 * pi / counts, wrap
        self.x = self.y = self.heading = 0.0
        #: angle by which each wheel has turned, rad
        self.left = self.right = 0.0
        self._counts: tuple[int, int] | None = None

    def place(self, x: float, y: float, heading: float) -> None:
        """Set the pose (m, rad), and the wheels' angles to 0."""
        self.x, self.y, self.heading = x, y, heading
        self.left = self.right = 0.0

    def forget(self) -> None:
        """Take the next counts as new ones: the encoders have started again."""
        self._counts = None

    def feed(self, left: int, right: int) -> None:
        """Move along an arc to these counts; each wheel turned the shorter way."""
        before, self._counts = self._counts, (left, right)
        if before is None:
            return
        turned = self._passed(before[0], left), self._passed(before[1], right)
        self.left += turned[0]
        self.right += turned[1]
        way = self._radius * (turned[0] + turned[1]) / 2
        turn = self._radius * (turned[1] - turned[0]) / self._track
        # The chord of an arc is shorter than the arc.
        chord = way * 2 * sincos(turn / 2)[0] / turn if turn else way
        sine, cosine = sincos(self.heading + turn / 2)
        self.x += chord * cosine
        self.y += chord * sine
        self.heading += turn

    def state(self) -> dict[str, float]:
        """Return the pose and the wheels' angles as fields of a state."""
        return {
            "x": self.x,
            "y": self.y,
            "heading": self.heading,
            "wheel/left": self.left,
            "wheel/right": self.right,
        }

    def _passed(self, before: int, after: int) -> float:
        half = self._wrap // 2
        return ((after - before + half) % self._wrap - half) * self._count


def only(found: Mapping[str, Any], paths: Iterable[str]) -> dict[str, Any]:
    """Return those of the fields that a definition has."""
    return {path: found[path] for path in paths if path in found}

"""Odometry: where two wheels have taken a robot, from the counts of their encoders."""

from __future__ import annotations

from math import pi

from rems_net.maths import sincos

#: counts of a whole turn of a wheel (OI specification, packet 43)
COUNTS = 508.8
#: after which an encoder begins anew
WRAP = 1 << 16


def passed(before: int, after: int) -> int:
    """Counts from one reading to the next, the shorter way round."""
    return (after - before + WRAP // 2) % WRAP - WRAP // 2


class Odometer:
    """Adds up a path. Lengths in m, angles in rad, counter-clockwise, not wrapped."""

    def __init__(self, wheel_radius: float, track: float):
        self._step, self._track = 2 * pi * wheel_radius / COUNTS, track
        self.x = self.y = self.heading = 0.0
        #: by how much each wheel has turned, rad
        self.left = self.right = 0.0
        self._counts: tuple[int, int] | None = None

    def place(self, x: float, y: float, heading: float) -> None:
        """Be there from now on, with wheels that have not turned yet."""
        self.x, self.y, self.heading = x, y, heading
        self.left = self.right = 0.0

    def forget(self) -> None:
        """The next counts follow nothing: the robot has begun to count anew."""
        self._counts = None

    def feed(self, left: int, right: int) -> None:
        """Go on to these counts, along an arc."""
        before, self._counts = self._counts, (left, right)
        if before is None:
            return
        turned = passed(before[0], left), passed(before[1], right)
        self.left += turned[0] * 2 * pi / COUNTS
        self.right += turned[1] * 2 * pi / COUNTS
        ways = turned[0] * self._step, turned[1] * self._step
        way, turn = (ways[0] + ways[1]) / 2, (ways[1] - ways[0]) / self._track
        # The chord of an arc is shorter than the arc.
        chord = way * 2 * sincos(turn / 2)[0] / turn if turn else way
        sine, cosine = sincos(self.heading + turn / 2)
        self.x += chord * cosine
        self.y += chord * sine
        self.heading += turn

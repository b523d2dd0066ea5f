"""Odometry: a robot's pose from the counts of its two wheels' encoders."""

from collections.abc import Mapping
from math import pi
from typing import Any, ClassVar

from rems_net.drivers.hardware.driven import Driven
from rems_net.drivers.needs import missing
from rems_net.maths import sincos

#: fields that a definition of a robot with such wheels has
NEEDED = ("wheel/left", "wheel/right", "wheel_radius", "track", "x", "y", "heading")


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


class Rolling(Driven):
    """Base of drivers of two wheels, whose encoders give the pose of the robot.

    counts, wrap: see Odometer.  fits: a definition for it
    """

    counts: ClassVar[float]
    wrap: ClassVar[int]
    fits: ClassVar[str]

    _path: Odometer

    def prepare(self) -> None:
        """Check that the definition has two wheels and a pose."""
        slots = type(self).command, type(self).state
        schemas = [slot.schema_for(self.parameters) for slot in slots]
        schemas.append(self.parameters.schema)
        has = {path for one in schemas if one for path in one.paths}
        if lacks := [path for path in NEEDED if path not in has]:
            example = f'take the definition "{self.fits}", or inherit from it'
            raise missing(self, ", ".join(lacks), "two wheels' odometry", example)
        super().prepare()

    def rewind(self) -> None:
        """Set the odometry to the initial pose; the robot itself does not move."""
        super().rewind()
        x, y, heading = (self.state[path] for path in ("x", "y", "heading"))
        if "_path" not in self.__dict__:
            p = self.parameters
            self._path = Odometer(p.wheel_radius, p.track, self.counts, self.wrap)
        self.perform(lambda: self._path.place(x, y, heading))

    def rolled(self, sensors: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
        """Return state and sensors by port: those fields that the definition has."""
        found = {"state": self._path.state(), "sensors": sensors}
        has = self.published()
        return {
            port: {path: read[path] for path in has[port].paths if path in read}
            for port, read in found.items()
            if port in has
        }

"""Arena: the place in which robots drive."""

from dataclasses import dataclass
from math import pi

from rems_net.bodies.parts import Vector
from rems_net.maths import cos, sin, tan

#: boxes of a round wall: 64 deviate from a circle of 0.4 m by half a millimetre
WALL_PIECES = 64
WALL_THICKNESS = 0.01


@dataclass(frozen=True, slots=True)
class Wall:
    """A box that stands in the arena, its middle at `at`, turned by `yaw` about z."""

    size: Vector
    at: Vector
    yaw: float


@dataclass(frozen=True, slots=True)
class Arena:
    """A flat floor at z = 0, with a round wall about the origin.

    radius: to the wall's inner face, m; 0 for no wall      wall_height: m
    """

    radius: float = 0.0
    wall_height: float = 0.1

    def walls(self) -> list[Wall]:
        """Return the boxes of the round wall."""
        if not self.radius:
            return []
        middle = self.radius + WALL_THICKNESS / 2
        length = 2 * (self.radius + WALL_THICKNESS) * tan(pi / WALL_PIECES)
        size = (WALL_THICKNESS, length, self.wall_height)
        turns = [2 * pi * piece / WALL_PIECES for piece in range(WALL_PIECES)]
        return [
            Wall(size, (middle * cos(t), middle * sin(t), self.wall_height / 2), t)
            for t in turns
        ]

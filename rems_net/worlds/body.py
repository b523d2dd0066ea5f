"""Body: what a robot is made of, told once and understood by every physics engine.

Frame: the origin is the point whose position the state tells; x ahead, y left, z up.
Everything is in SI units; an axis or a direction is a unit vector; a turn is positive
by the right-hand rule.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import hypot, pi
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from rems_net.errors import SchemaError
from rems_net.maths import cos, sin, tan

Vector = tuple[float, float, float]
Array = NDArray[np.float64]

#: Where a compass points, in the arena's frame: along +y.
NORTH: Vector = (0.0, 1.0, 0.0)
#: Along z, m/s2.
GRAVITY = -9.81
#: A round wall is made of boxes: 64 leave a circle of 0.4 m by half a millimetre.
WALL_PIECES = 64
WALL_THICKNESS = 0.01


def _check_length(axis: Vector) -> None:
    if abs(hypot(*axis) - 1) > 1e-6:
        raise SchemaError(
            f"An axis or a direction has length 1, as (0, 1, 0) has; got {axis}."
        )


@dataclass(frozen=True, slots=True)
class Box:
    """A box with these full edge lengths, m."""

    size: Vector


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder about `axis`; radius and length in m."""

    radius: float
    length: float
    axis: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        _check_length(self.axis)


@dataclass(frozen=True, slots=True)
class Sphere:
    """A ball; radius in m."""

    radius: float


Shape = Box | Cylinder | Sphere


@dataclass(frozen=True, slots=True)
class Part:
    """One solid of even density.

    mass: kg      at: its middle, m
    friction: Coulomb's coefficient against floor and walls; None touches nothing
    """

    shape: Shape
    mass: float
    at: Vector = (0.0, 0.0, 0.0)
    friction: float | None = 0.5


@dataclass(frozen=True, slots=True)
class Hinge:
    """Parts that a motor turns about an axis.

    name: path of the command that sets its speed, rad/s
    parts: placed relative to `at`
    torque: the most the motor can give, at standstill, N m
    droop: how far it falls behind the commanded speed when it gives all its torque,
        rad/s; the no-load speed of a plain DC motor, little where a loop holds it
    armature: inertia of the motor and its gears, felt at the axis, kg m2
    """

    name: str
    parts: tuple[Part, ...]
    at: Vector
    axis: Vector
    torque: float
    droop: float
    armature: float = 0.0

    def __post_init__(self) -> None:
        _check_length(self.axis)


@dataclass(frozen=True, slots=True)
class Ray:
    """Distance along `direction` to the nearest floor or wall, at most `reach`, m."""

    name: str
    at: Vector
    direction: Vector
    reach: float

    def __post_init__(self) -> None:
        _check_length(self.direction)


@dataclass(frozen=True, slots=True)
class Gyro:
    """Angular velocity about `axis`, rad/s."""

    name: str
    axis: Vector

    def __post_init__(self) -> None:
        _check_length(self.axis)


@dataclass(frozen=True, slots=True)
class Compass:
    """How much of the unit vector to the north lies along `axis`, -1 to 1."""

    name: str
    axis: Vector

    def __post_init__(self) -> None:
        _check_length(self.axis)


#: Each fills one field of the robot's sensors: the one it names.
Sensor = Ray | Gyro | Compass


@dataclass(frozen=True, slots=True)
class Body:
    """A robot standing on the floor.

    parts: rigidly together      hinges: what its motors turn      sensors: its senses
    height: of the frame's origin above the floor when the robot stands, m
    """

    parts: tuple[Part, ...]
    hinges: tuple[Hinge, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    height: float = 0.0


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
        """Return the boxes that the round wall is made of."""
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


@runtime_checkable
class Embodied(Protocol):
    """A definition that physics can run. It may offer `arena()`, too."""

    def body(self) -> Body:
        """What the robot is made of."""
        ...


@dataclass(frozen=True, slots=True)
class Lump:
    """Rigid parts as one: mass kg, centre (3,) m, inertia (3, 3) kg m2 about it."""

    mass: float
    centre: Array
    inertia: Array


def lump(parts: Iterable[Part]) -> Lump:
    """Add up masses and inertias (Steiner), so that every engine gets the same."""
    parts = tuple(parts)
    mass = sum(part.mass for part in parts)
    if not mass > 0:
        raise SchemaError(
            "What moves needs a mass: give one of its parts more than 0 kg."
        )
    centre = sum((part.mass * np.array(part.at) for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        away = np.array(part.at) - centre
        steiner = away @ away * np.eye(3) - np.outer(away, away)
        inertia += part.mass * (_inertia_per_mass(part.shape) + steiner)
    return Lump(mass, centre, inertia)


def _inertia_per_mass(shape: Shape) -> Array:
    match shape:
        case Box(size):
            square = np.square(size)
            return np.diag((square.sum() - square) / 12)
        case Cylinder(radius, length, axis):
            along = np.outer(axis, axis)
            across = (3 * radius**2 + length**2) / 12
            return across * (np.eye(3) - along) + radius**2 / 2 * along
        case Sphere(radius):
            return 0.4 * radius**2 * np.eye(3)

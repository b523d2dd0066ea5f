"""Parts: solids of even density, and their mass and inertia together."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.typing import NDArray

from rems_net.errors import SchemaError

Vector = tuple[float, float, float]
Array = NDArray[np.float64]


def check_length(axis: Vector) -> None:
    """Raise SchemaError for an axis or a direction that is not a unit vector."""
    if abs(hypot(*axis) - 1) > 1e-6:
        raise SchemaError(
            "An axis or a direction has length 1, as (0, 1, 0) has; got "
            f"{axis}. (R0215)"
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
        check_length(self.axis)


@dataclass(frozen=True, slots=True)
class Sphere:
    """A ball; radius in m."""

    radius: float


Shape = Box | Cylinder | Sphere


@dataclass(frozen=True, slots=True)
class Part:
    """One solid of even density.

    mass: kg      at: its middle, m
    friction: Coulomb's coefficient against floor and walls; None if it touches nothing
    """

    shape: Shape
    mass: float
    at: Vector = (0.0, 0.0, 0.0)
    friction: float | None = 0.5


@dataclass(frozen=True, slots=True)
class Lump:
    """Rigid parts as one: mass kg, centre (3,) m, inertia (3, 3) kg m2 about it."""

    mass: float
    centre: Array
    inertia: Array


def lump(parts: Iterable[Part]) -> Lump:
    """Return the sum of masses and inertias (Steiner), the same for every engine."""
    parts = tuple(parts)
    mass = sum(part.mass for part in parts)
    if not mass > 0:
        raise SchemaError(
            "A body that moves needs a mass: give one of its parts more than "
            "0 kg. (R0210)"
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

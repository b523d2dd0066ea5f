"""Sensors of a body: each fills one field of the robot's sensors, the one it names."""

from __future__ import annotations

from dataclasses import dataclass

from rems_net.worlds.parts import Vector, check_length


@dataclass(frozen=True, slots=True)
class Ray:
    """Distance along `direction` to the nearest thing, at most `reach`, m.

    Floor, walls, what lies about, other robots; the robot itself is not seen.
    """

    name: str
    at: Vector
    direction: Vector
    reach: float

    def __post_init__(self) -> None:
        check_length(self.direction)


@dataclass(frozen=True, slots=True)
class Switch:
    """Whether something is nearer than `reach`, m, along any of its rays.

    A bumper has rays of a few millimetres; a cliff sensor looks down, and is `empty`:
    it tells that nothing is there.
    rays: where each begins, and its direction
    """

    name: str
    rays: tuple[tuple[Vector, Vector], ...]
    reach: float
    empty: bool = False

    def __post_init__(self) -> None:
        for _, direction in self.rays:
            check_length(direction)


@dataclass(frozen=True, slots=True)
class Gyro:
    """Angular velocity about `axis`, rad/s."""

    name: str
    axis: Vector

    def __post_init__(self) -> None:
        check_length(self.axis)


@dataclass(frozen=True, slots=True)
class Compass:
    """How much of the unit vector to the north lies along `axis`, -1 to 1."""

    name: str
    axis: Vector

    def __post_init__(self) -> None:
        check_length(self.axis)


@dataclass(frozen=True, slots=True)
class Encoder:
    """How far a joint is from its zero: rad of a hinge, m of a slide.

    joint: its name
    """

    name: str
    joint: str


@dataclass(frozen=True, slots=True)
class Tachometer:
    """How fast a joint moves: rad/s of a hinge, m/s of a slide.

    joint: its name
    """

    name: str
    joint: str


Sensor = Ray | Switch | Gyro | Compass | Encoder | Tachometer

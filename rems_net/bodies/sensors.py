"""Sensors of a body: each fills one field of the robot's sensors, the one it names."""

from dataclasses import dataclass

from rems_net.bodies.parts import Vector, check_length
from rems_net.errors import SchemaError
from rems_net.maths import hypot, tan


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
class _Along:
    """A sensor with an axis in the frame of the robot, a unit vector."""

    name: str
    axis: Vector

    def __post_init__(self) -> None:
        check_length(self.axis)


class Gyro(_Along):
    """Angular velocity about `axis`, rad/s."""


class Accelerometer(_Along):
    """Specific force along `axis`, m/s2: what moves the robot, but for gravity.

    At rest it is 9.81 along what is up. It is from how the velocity of the robot's
    origin has changed over the last tick: where it is bolted, and shaking that is
    faster than that, are left out.
    """


class Compass(_Along):
    """How much of the unit vector to the north lies along `axis`, -1 to 1."""


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


@dataclass(frozen=True, slots=True)
class Camera:
    """A picture of what is along `direction`, as both physics engines draw it.

    Its field is an array of u1, `shape`: red, green and blue of each pixel, row by row
    from the upper left. The picture stands upright; where the camera looks straight
    down, ahead is up. Of the robot itself it sees what is before it. By mathematics
    alone there is no picture, and it stays black.

    width, height: pixels      field_of_view: from left to right, rad
    every: it takes a picture at every so many steps of its robot, from the start on
    """

    name: str
    at: Vector
    direction: Vector
    width: int
    height: int
    field_of_view: float
    every: int = 1

    def __post_init__(self) -> None:
        check_length(self.direction)
        if self.every < 1:
            raise SchemaError(
                f"every is 1 or more steps between two pictures; got {self.every}."
            )
        if self.width < 1 or self.height < 1:
            raise SchemaError(
                f"A camera has 1 pixel or more each way, such as 52 by 39; got "
                f"{self.width} by {self.height}."
            )
        if not 0 < self.field_of_view < 3:
            raise SchemaError(
                f"A camera's field of view is more than 0 and less than 3 rad; got "
                f"{self.field_of_view:g}. In degrees: radians(50)."
            )

    @property
    def shape(self) -> tuple[int, int, int]:
        """Of its field: height, width, and 3 for the colours."""
        return self.height, self.width, 3

    @property
    def up(self) -> Vector:
        """The unit vector to the top of the picture."""
        x, y, z = self.direction
        level = float(hypot(x, y))
        if level < 1e-6:
            return (-z, 0.0, 0.0)
        return (-z * x / level, -z * y / level, level)

    @property
    def slopes(self) -> tuple[float, float]:
        """How far to the right and up the picture reaches, 1 m ahead, m."""
        right = float(tan(self.field_of_view / 2))
        return right, right * self.height / self.width


Sensor = Ray | Switch | Gyro | Accelerometer | Compass | Encoder | Tachometer | Camera

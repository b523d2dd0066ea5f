"""Sensors of a body: each sets the field of the robot's sensors with its name."""

from dataclasses import dataclass

from rems_net.bodies.lens import Lens
from rems_net.bodies.parts import Vector, check_length
from rems_net.errors import SchemaError
from rems_net.maths import hypot, tan


@dataclass(frozen=True, slots=True)
class Ray:
    """Distance along `direction` to the nearest thing, at most `reach`, m.

    It meets floor, walls, things and other robots, but not the robot itself.
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

    A bumper has rays of a few millimetres. A cliff sensor looks down, and is `empty`:
    its value is true if nothing is there.
    rays: start and direction of each
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
    """Specific force along `axis`, m/s2: acceleration minus that of gravity.

    At rest it is 9.81 along an axis that points up. It is computed from the change of
    the velocity of the robot's origin over the last tick: the sensor's own place, and
    faster vibration, are left out.
    """


class Compass(_Along):
    """Component of the unit vector to the north along `axis`, -1 to 1."""


@dataclass(frozen=True, slots=True)
class Encoder:
    """Position of a joint from its zero: rad for a hinge, m for a slide.

    joint: its name
    """

    name: str
    joint: str


@dataclass(frozen=True, slots=True)
class Tachometer:
    """Speed of a joint: rad/s for a hinge, m/s for a slide.

    joint: its name
    """

    name: str
    joint: str


@dataclass(frozen=True, slots=True)
class Camera:
    """A picture of the view along `direction`, as both physics engines draw it.

    Its field is an array of u1, `shape`: red, green and blue of each pixel, row by row
    from the upper left. The picture stands upright; if the camera looks straight down,
    ahead is up. Parts of the robot itself before the camera are in the picture. The
    kinematic driver draws nothing: the picture stays black.

    width, height: pixels      field_of_view: from left to right, rad
    every: number of the robot's steps from one picture to the next
    lens: in place of the field of view; None for an ideal one
    top: unit vector to the picture's top, across `direction`; None for the upright one
    blur, grain: of the chip, if the driver's option `noise` is on: standard deviations
        of a point's image, pixels, and of its brightness, of 255
    stamp: field of the sensors for the tick of the picture; "" for none
    """

    name: str
    at: Vector
    direction: Vector
    width: int
    height: int
    field_of_view: float
    every: int = 1
    lens: Lens | None = None
    top: Vector | None = None
    blur: float = 0.0
    grain: float = 0.0
    stamp: str = ""

    def __post_init__(self) -> None:
        check_length(self.direction)
        if self.every < 1:
            raise SchemaError(
                "every is 1 or more steps between two pictures; got "
                f"{self.every}. (R0215)"
            )
        if self.width < 1 or self.height < 1:
            raise SchemaError(
                f"A camera has 1 pixel or more each way, such as 52 by 39; got "
                f"{self.width} by {self.height}. (R0215)"
            )
        if not 0 < self.field_of_view < 3:
            raise SchemaError(
                f"A camera's field of view is more than 0 and less than 3 rad; got "
                f"{self.field_of_view:g}. In degrees: radians(50). (R0215)"
            )

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of its field: height, width, and 3 for the colours."""
        return self.height, self.width, 3

    @property
    def up(self) -> Vector:
        """The unit vector to the top of the picture."""
        if self.top is not None:
            return self.top
        x, y, z = self.direction
        level = float(hypot(x, y))
        if level < 1e-6:
            return (-z, 0.0, 0.0)
        return (-z * x / level, -z * y / level, level)

    @property
    def edges(self) -> tuple[float, float, float, float]:
        """Slopes of the picture's edges: left, right, bottom and top."""
        if self.lens is not None:
            return self.lens.edges()
        right = float(tan(self.field_of_view / 2))
        top = right * self.height / self.width
        return -right, right, -top, top


Sensor = Ray | Switch | Gyro | Accelerometer | Compass | Encoder | Tachometer | Camera

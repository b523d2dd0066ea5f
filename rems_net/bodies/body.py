"""Body: a robot's parts, joints and sensors, described once for every physics engine.

Frame: the origin is the point whose position is in the state; x ahead, y left, z up.
Everything is in SI units; an axis or a direction is a unit vector; a turn is positive
by the right-hand rule.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

# All classes that describe a body can be imported from here.
from rems_net.bodies.arena import Arena as Arena, Wall as Wall
from rems_net.bodies.joints import (
    Hinge as Hinge,
    Joint as Joint,
    Loop as Loop,
    Servo as Servo,
    Slide as Slide,
)
from rems_net.bodies.marker import Marker as Marker
from rems_net.bodies.model import Driven as Driven, Model as Model, Source as Source
from rems_net.bodies.parts import (
    Array as Array,
    Box as Box,
    Cylinder as Cylinder,
    Lump as Lump,
    Part as Part,
    Shape as Shape,
    Sphere as Sphere,
    Vector as Vector,
    lump as lump,
)
from rems_net.bodies.sensors import (
    Accelerometer as Accelerometer,
    Camera as Camera,
    Compass as Compass,
    Encoder as Encoder,
    Gyro as Gyro,
    Ray as Ray,
    Sensor as Sensor,
    Switch as Switch,
    Tachometer as Tachometer,
)

#: North of a compass, in the arena's frame: along +y.
NORTH: Vector = (0.0, 1.0, 0.0)
#: m/s2, along z.
GRAVITY = -9.81


@dataclass(frozen=True, slots=True)
class Body:
    """A robot standing on the floor, or bolted to it.

    parts: rigidly together      joints: move on the parts      sensors: of the robot
    height: of the frame's origin above the floor when the robot stands, m
    fixed: whether it cannot move, as an arm on a table. The state has its pose, if it
        has x, y and a heading; else `initial` has
    loops: points at which chains of joints are closed
    source: the file that engines load in place of parts and joints, which stand for
        its content (see `bodies.files`); None for a body that is described here
    markers: that are drawn on it, for cameras; they touch and weigh nothing
    """

    parts: tuple[Part, ...]
    joints: tuple[Joint, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    height: float = 0.0
    fixed: bool = False
    loops: tuple[Loop, ...] = ()
    source: Source | None = None
    markers: tuple[Marker, ...] = ()


@runtime_checkable
class Embodied(Protocol):
    """A definition that physics can run. It may offer `arena()`, too."""

    def body(self) -> Body | Model:
        """Return the robot's body, or the model of its file."""

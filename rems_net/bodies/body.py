"""Body: a robot's parts, joints and sensors, described once for every physics engine.

Frame: the origin is the point whose position is in the state; x ahead, y left, z up.
Everything is in SI units; an axis or a direction is a unit vector; a turn is positive
by the right-hand rule.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

# All classes that describe a body can be imported from here.
from rems_net.bodies.arena import Arena as Arena
from rems_net.bodies.arena import Wall as Wall
from rems_net.bodies.joints import Hinge as Hinge
from rems_net.bodies.joints import Joint as Joint
from rems_net.bodies.joints import Loop as Loop
from rems_net.bodies.joints import Servo as Servo
from rems_net.bodies.joints import Slide as Slide
from rems_net.bodies.marker import Marker as Marker
from rems_net.bodies.model import Driven as Driven
from rems_net.bodies.model import Model as Model
from rems_net.bodies.model import Source as Source
from rems_net.bodies.parts import Array as Array
from rems_net.bodies.parts import Box as Box
from rems_net.bodies.parts import Cylinder as Cylinder
from rems_net.bodies.parts import Lump as Lump
from rems_net.bodies.parts import Part as Part
from rems_net.bodies.parts import Shape as Shape
from rems_net.bodies.parts import Sphere as Sphere
from rems_net.bodies.parts import Vector as Vector
from rems_net.bodies.parts import lump as lump
from rems_net.bodies.sensors import Accelerometer as Accelerometer
from rems_net.bodies.sensors import Camera as Camera
from rems_net.bodies.sensors import Compass as Compass
from rems_net.bodies.sensors import Encoder as Encoder
from rems_net.bodies.sensors import Gyro as Gyro
from rems_net.bodies.sensors import Ray as Ray
from rems_net.bodies.sensors import Sensor as Sensor
from rems_net.bodies.sensors import Switch as Switch
from rems_net.bodies.sensors import Tachometer as Tachometer

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

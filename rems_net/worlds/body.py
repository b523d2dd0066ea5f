"""Body: what a robot is made of, told once and understood by every physics engine.

Frame: the origin is the point whose position the state tells; x ahead, y left, z up.
Everything is in SI units; an axis or a direction is a unit vector; a turn is positive
by the right-hand rule.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from rems_net.worlds.arena import Arena, Wall
from rems_net.worlds.joints import Hinge, Joint, Loop, Servo, Slide
from rems_net.worlds.model import Driven, Model, Source
from rems_net.worlds.parts import (
    Array,
    Box,
    Cylinder,
    Lump,
    Part,
    Shape,
    Sphere,
    Vector,
    lump,
)
from rems_net.worlds.sensors import (
    Accelerometer,
    Camera,
    Compass,
    Encoder,
    Gyro,
    Ray,
    Sensor,
    Switch,
    Tachometer,
)

__all__ = [
    "GRAVITY",
    "NORTH",
    "Accelerometer",
    "Arena",
    "Array",
    "Body",
    "Box",
    "Camera",
    "Compass",
    "Cylinder",
    "Driven",
    "Embodied",
    "Encoder",
    "Gyro",
    "Hinge",
    "Joint",
    "Loop",
    "Lump",
    "Model",
    "Part",
    "Ray",
    "Sensor",
    "Servo",
    "Shape",
    "Slide",
    "Source",
    "Sphere",
    "Switch",
    "Tachometer",
    "Vector",
    "Wall",
    "lump",
]

#: Where a compass points, in the arena's frame: along +y.
NORTH: Vector = (0.0, 1.0, 0.0)
#: Along z, m/s2.
GRAVITY = -9.81


@dataclass(frozen=True, slots=True)
class Body:
    """A robot standing on the floor, or bolted to it.

    parts: rigidly together      joints: what moves on them      sensors: its senses
    height: of the frame's origin above the floor when the robot stands, m
    fixed: whether it cannot move, as an arm on a table. It stands where the state says,
        if that has x, y and a heading; else where `initial` says
    loops: where chains of joints are closed
    source: the file that engines load in place of parts and joints, which stand for
        what is in it (see `drivers.models`); None for a body that is told here
    """

    parts: tuple[Part, ...]
    joints: tuple[Joint, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    height: float = 0.0
    fixed: bool = False
    loops: tuple[Loop, ...] = ()
    source: Source | None = None


@runtime_checkable
class Embodied(Protocol):
    """A definition that physics can run. It may offer `arena()`, too."""

    def body(self) -> Body | Model:
        """What the robot is made of, or the file that says so."""

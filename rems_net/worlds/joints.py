"""Joints: what lets one thing move on another, and the motor that moves it.

Joints make a tree: each has parts, and carries further joints. While all of them are
at zero, every frame is parallel to the body's own.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from rems_net.errors import SchemaError
from rems_net.worlds.parts import Part, Vector, check_length


@dataclass(frozen=True, slots=True)
class Servo:
    """A loop around a motor, so that what it is told is a position and not a speed.

    What it asks for goes to the target at `speed` and halts there; the motor is told
    that speed, and `gain` times what the joint is behind.
    gain: 1/s      speed: rad/s of a hinge, m/s of a slide
    share: path of the command that is the part of `speed` to go at, 0 to 1: at 0 the
        joint holds where it is; "" for all of it
    """

    gain: float
    speed: float
    share: str = ""

    def __post_init__(self) -> None:
        if not (self.gain > 0 and self.speed > 0):
            raise SchemaError(
                f"A servo has gain {self.gain} and speed {self.speed}; expected both "
                "above 0."
            )


@dataclass(frozen=True, slots=True)
class Hinge:
    """Parts that turn about an axis, and what they carry.

    name: of the joint; no other of the body has it
    parts: placed relative to `at`
    at, axis: where it is on what carries it, m
    torque: the most the motor can give, at standstill, N m; 0 turns freely
    droop: how far it falls behind the commanded speed when it gives all its torque,
        rad/s; the no-load speed of a plain DC motor, little where a loop holds it, but
        no less than it gains in one step of the physics: else it chatters
    armature: inertia of the motor and its gears, felt at the axis, kg m2
    command: path of the field of the command that sets its speed, rad/s, or with a
        servo its angle, rad; where it is not the name. Several joints may obey one.
    servo: makes the command an angle
    limits: the stops, lowest and highest angle, rad; None turns without end
    damping: friction that grows with speed, N m s/rad
    position: path of the state that is its angle, of the first of several; all of
        them start there; "" for none
    rollers: of a wheel whose rim is made of rollers (mecanum, omni): the axis of the
        one that touches the floor, horizontal. It drives along that axis only.
    joints: what its parts carry, placed relative to `at`
    """

    name: str
    parts: tuple[Part, ...]
    at: Vector
    axis: Vector
    torque: float = 0.0
    droop: float = 0.0
    armature: float = 0.0
    command: str = ""
    servo: Servo | None = None
    limits: tuple[float, float] | None = None
    damping: float = 0.0
    position: str = ""
    rollers: Vector | None = None
    joints: tuple[Joint, ...] = ()

    def __post_init__(self) -> None:
        check_length(self.axis)
        _check(self, "torque")
        if self.rollers is not None:
            check_length(self.rollers)
            if abs(self.rollers[2]) > 1e-6 or abs(self.grip) < 1e-3:
                raise SchemaError(
                    f"The rollers of {self.name!r} lie flat and not along the axle; "
                    f"got {self.rollers} on the axle {self.axis}. Try (0.7071, "
                    "-0.7071, 0)."
                )

    @property
    def obeys(self) -> str:
        """The path of what it is told."""
        return self.command or self.name

    @property
    def effort(self) -> float:
        """What the motor can give, N m."""
        return self.torque

    @property
    def grip(self) -> float:
        """Speed along the rollers' axis by speed of the rim, -1 to 1; 1 without."""
        if self.rollers is None:
            return 1.0
        # The rim drives along axis x up.
        return self.axis[1] * self.rollers[0] - self.axis[0] * self.rollers[1]


@dataclass(frozen=True, slots=True)
class Slide:
    """Parts that slide along an axis, and what they carry: m, m/s and N.

    As a Hinge in everything else; `force` is the most the motor can give, `armature`
    the mass of motor and gears that is felt along the axis, kg.
    """

    name: str
    parts: tuple[Part, ...]
    at: Vector
    axis: Vector
    force: float = 0.0
    droop: float = 0.0
    armature: float = 0.0
    command: str = ""
    servo: Servo | None = None
    limits: tuple[float, float] | None = None
    damping: float = 0.0
    position: str = ""
    joints: tuple[Joint, ...] = ()

    def __post_init__(self) -> None:
        check_length(self.axis)
        _check(self, "force")

    @property
    def obeys(self) -> str:
        """The path of what it is told."""
        return self.command or self.name

    @property
    def effort(self) -> float:
        """What the motor can give, N."""
        return self.force


Joint = Hinge | Slide


@dataclass(frozen=True, slots=True)
class Loop:
    """A point that two links share, which closes a chain of joints to a loop.

    first, second: the joints that move the links, by name
    at: the point, m in the body's frame, while all joints are at zero: there the loop
        is closed
    """

    first: str
    second: str
    at: Vector


def _check(joint: Joint, what: str) -> None:
    name, effort, droop = joint.name, joint.effort, joint.droop
    if not 0 <= effort < inf or droop < 0 or (effort > 0 and droop == 0):
        raise SchemaError(
            f"The motor of {name!r} has {what} {effort} and droop {droop}; expected "
            f"both above 0, or no {what} for a joint that moves freely."
        )
    if joint.servo is not None and not effort:
        raise SchemaError(f"The servo of {name!r} has no motor: give it a {what}.")
    if joint.limits is not None and not joint.limits[0] < joint.limits[1]:
        raise SchemaError(
            f"The limits of {name!r} are {joint.limits}; expected the lower one first."
        )

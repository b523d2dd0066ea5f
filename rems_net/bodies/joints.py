"""Joints: connections on which one part moves on another, and their motors.

Joints make a tree: each has parts, and carries further joints. While all joints are at
zero, every frame is parallel to the body's own.
"""

from dataclasses import KW_ONLY, dataclass
from math import inf

from rems_net.bodies.parts import Part, Vector, check_length
from rems_net.errors import SchemaError


@dataclass(frozen=True, slots=True)
class Servo:
    """Position control of a motor: its command is a position instead of a speed.

    The setpoint goes to the target at `speed` and halts there. The motor's speed is the
    setpoint's speed plus `gain` times the joint's distance to the setpoint.
    gain: 1/s      speed: rad/s of a hinge, m/s of a slide
    share: path of the field of the command that is the share of `speed`, 0 to 1: at 0
        the joint holds its position; "" for full speed
    """

    gain: float
    speed: float
    share: str = ""

    def __post_init__(self) -> None:
        if not (self.gain > 0 and self.speed > 0):
            raise SchemaError(
                f"A servo has gain {self.gain} and speed {self.speed}; expected both "
                "above 0. (R0209)"
            )


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint: parts that move along or about an axis, and the joints they carry.

    name: of the joint; no other of the body has it
    parts: placed relative to `at`
    at: position on the part that carries the joint, m      axis: unit vector
    droop: loss of speed at the motor's full effort, rad/s or m/s: for a plain DC motor
        its no-load speed, with speed control little; but no less than the motor gains
        in one step of the physics, or it chatters
    armature: inertia of the motor and its gears, felt at the axis, kg m2 or kg
    command: path of the command's field for its speed, or with a servo its position;
        "" for the name. Several joints may obey one field.
    ratio: motion of the joint per motion commanded, as of a gear; negative reverses
    servo: makes the command a position
    limits: the stops, lowest and highest position; None moves without end
    damping: friction that grows with speed, N m s/rad or N s/m
    position: path of the state's field for its position; if several joints have the
        same, the first one sets it, and all start there; "" for none
    joints: carried by its parts, placed relative to `at`
    """

    name: str
    parts: tuple[Part, ...]
    at: Vector
    axis: Vector
    _: KW_ONLY
    droop: float = 0.0
    armature: float = 0.0
    command: str = ""
    ratio: float = 1.0
    servo: Servo | None = None
    limits: tuple[float, float] | None = None
    damping: float = 0.0
    position: str = ""
    joints: "tuple[Joint, ...]" = ()

    def __post_init__(self) -> None:
        name, (what, effort), droop = self.name, self.motor, self.droop
        check_length(self.axis)
        if not 0 <= effort < inf or droop < 0 or (effort > 0 and droop == 0):
            raise SchemaError(
                f"The motor of {name!r} has {what} {effort} and droop {droop}; "
                f"expected both above 0, or no {what} for a joint that moves "
                "freely. (R0209)"
            )
        if self.servo is not None and not effort:
            raise SchemaError(
                f"The servo of {name!r} has no motor: give it a {what}. (R0209)"
            )
        if self.limits is not None and not self.limits[0] < self.limits[1]:
            raise SchemaError(
                f"The limits of {name!r} are {self.limits}; expected the lower one "
                "first. (R0209)"
            )

    @property
    def obeys(self) -> str:
        """Path of the field of the command that the joint obeys."""
        return self.command or self.name

    @property
    def motor(self) -> tuple[str, float]:
        """Name of the motor's effort, and its greatest value, N m or N."""
        raise NotImplementedError(f"{type(self).__name__}.motor")

    @property
    def effort(self) -> float:
        """Greatest effort of the motor, N m or N."""
        return self.motor[1]


@dataclass(frozen=True, slots=True)
class Hinge(Joint):
    """A joint that turns about its axis: rad, rad/s and N m.

    torque: greatest torque of the motor, at standstill, N m; 0 turns freely
    rollers: of a wheel with rollers on its rim (mecanum, omni): the axis of the roller
        that touches the floor, horizontal. The wheel drives along that axis only.
    """

    _: KW_ONLY
    torque: float = 0.0
    rollers: Vector | None = None

    def __post_init__(self) -> None:
        Joint.__post_init__(self)
        if self.rollers is not None:
            check_length(self.rollers)
            if abs(self.rollers[2]) > 1e-6 or abs(self.grip) < 1e-3:
                raise SchemaError(
                    f"The rollers of {self.name!r} lie flat and not along the axle; "
                    f"got {self.rollers} on the axle {self.axis}. Try (0.7071, "
                    "-0.7071, 0). (R0215)"
                )

    @property
    def motor(self) -> tuple[str, float]:
        """Torque, N m."""
        return "torque", self.torque

    @property
    def grip(self) -> float:
        """Speed along the rollers' axis per speed of the rim, -1 to 1; 1 without."""
        if self.rollers is None:
            return 1.0
        # The rim drives along the cross product of axis and up.
        return self.axis[1] * self.rollers[0] - self.axis[0] * self.rollers[1]


@dataclass(frozen=True, slots=True)
class Slide(Joint):
    """A joint that slides along its axis: m, m/s and N.

    force: greatest force of the motor, at standstill, N; 0 slides freely
    """

    _: KW_ONLY
    force: float = 0.0

    @property
    def motor(self) -> tuple[str, float]:
        """Force, N."""
        return "force", self.force


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

"""Differential: base of all robots on left and right wheels."""

from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.robot import Definition
from rems_net.bodies.actuators import GROUP, actuation
from rems_net.bodies.body import (
    Accelerometer,
    Arena,
    Body,
    Camera,
    Cylinder,
    Encoder,
    Hinge,
    Part,
    Sensor,
    Vector,
)
from rems_net.defdict import (
    DefDict,
    Field,
    Schema,
    angle,
    angular_velocity,
    length,
    mass,
    number,
    torque,
)
from rems_net.errors import SchemaError, nearest
from rems_net.kinematics.wheels import Wheels, differential
from rems_net.maths import sincos
from rems_net.robots.pose import pose
from rems_net.robots.sensing import read

#: Parameters of such a robot. The ranges exclude nonsense; none is a measured value.
FIGURES: dict[str, Callable[..., Field]] = {
    "wheel_radius": partial(length, range=(0.001, 10)),
    "track": partial(length, range=(0.001, 100)),
    "effective_track": partial(length, range=(0.001, 100)),
    "max_wheel_speed": partial(angular_velocity, range=(0.01, 1000)),
    "mass": partial(mass, range=(0.01, 1e5)),
    "centre_of_mass": partial(length, range=(-10, 10)),
    "wheel_torque": partial(torque, range=(1e-4, 1e6)),
    "wheel_friction": partial(number, range=(0, 5)),
    "arena_radius": partial(length, range=(0, 1000)),
}

#: Width of a wheel's tread, and its shoulders' radius, both as a share of its radius: a
#: flat tyre of full width would roll on its outer edge in a turn.
TREAD, SHOULDER = 0.05, 0.97

#: sensors of most of them: angle that each side's wheel has turned
ENCODERS = (
    Encoder("encoder/left", "wheel/left"),
    Encoder("encoder/right", "wheel/right"),
)

#: sensors that the driver computes: acceleration, and pictures
LEFT = (Accelerometer, Camera)


def figures(**given: tuple[float, str]) -> Settings:
    """Return parameters, each with its default and the source of that.

    Raises SchemaError for a name that is not among FIGURES.
    """
    for name in given:
        if name not in FIGURES:
            raise SchemaError(
                f"figures() takes no {name!r}; it takes {', '.join(FIGURES)}."
                f"{nearest(name, FIGURES)} Others go into a Settings of your "
                "own. (R0222)"
            )
    given.setdefault("arena_radius", (0.0, "of a round wall about it; 0 for none"))
    return Settings(
        {name: FIGURES[name](default=d, doc=doc) for name, (d, doc) in given.items()}
        | {GROUP: actuation("wheel/left", "wheel/right")}
    )


def wheel_speeds(parameters: DefDict, name: str = "differential.command") -> Schema:
    """Return the schema of a command to two sides of wheels, positive ahead."""
    top = parameters.max_wheel_speed
    speed = angular_velocity(range=(-top, top))
    return Schema(name, {"wheel/left": speed, "wheel/right": speed})


class Differential(Definition):
    """A robot that turns by driving its left and right wheels at different speeds.

    Frame: the origin is the middle between the wheels, as high as their axles; x
    ahead, y left, z up. The heading is counted from +x of the arena,
    counter-clockwise, and goes on past a full turn. A positive wheel speed drives
    ahead. A subclass states its figures, its `senses` and its `chassis`.
    """

    #: the robot's sensors, in the order of the port
    senses: ClassVar[tuple[Sensor, ...]] = ()
    #: of one wheel: m, kg, and kg m2 of its motor and gears. In MuJoCo a wheel slips if
    #: it is much lighter than wheel_torque / (droop * full speed) * physics_step.
    wheel_width: ClassVar[float] = 0.01
    wheel_mass: ClassVar[float] = 0.01
    gears: ClassVar[float] = 0.0
    #: loss of speed of a motor at full torque, as a share of full speed: little,
    #: because a loop controls the speed
    droop: ClassVar[float] = 0.01
    #: the parameter that is the distance between the two sides in a turn
    turning_track: ClassVar[str] = "track"
    #: whether the state has the angles of the wheels
    angles: ClassVar[bool] = True
    integrator = "euler"  # as in the class's model

    command = In(wheel_speeds)
    state = Out(
        Schema(
            "differential.state",
            {
                **pose("the middle between the wheels"),
                "wheel/left": angle(doc="since the start, positive ahead, not wrapped"),
                "wheel/right": angle(doc="since the start, positive ahead"),
            },
        )
    )

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        """Return each state field's rate, per second, for wheels that do not slip."""
        p = self.parameters
        left, right = command["wheel/left"], command["wheel/right"]
        speed = p.wheel_radius * (left + right) / 2
        sine, cosine = sincos(state["heading"])
        rates = {
            "x": speed * cosine,
            "y": speed * sine,
            "heading": self.turning(command),
        }
        if self.angles:
            rates |= {"wheel/left": left, "wheel/right": right}
        return rates

    def turning(self, command: DefDict) -> Any:
        """Return the rate of the heading, rad/s."""
        p = self.parameters
        faster = command["wheel/right"] - command["wheel/left"]
        return p.wheel_radius * faster / p[self.turning_track]

    def mechanisms(self) -> dict[str, Wheels]:
        """Return the kinematics of the wheels."""
        p = self.parameters
        wheels, track = ("wheel/left", "wheel/right"), p[self.turning_track]
        return {"base": differential(wheels, p.wheel_radius, track, p.max_wheel_speed)}

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        """Return the sensors' values in this state, without noise."""
        p = self.parameters
        s, c = sincos(state["heading"])
        pose = state["x"], state["y"], c, s
        turning = self.turning(command)
        height, wall = p.wheel_radius, p.arena_radius
        return {
            sense.name: read(sense, pose, turning, state, height, wall)
            for sense in self.senses
            if not isinstance(sense, LEFT)
        }

    def body(self) -> Body:
        """Return the robot's parts, wheels and sensors."""
        hinges = self.wheels()
        rolling = sum(part.mass for hinge in hinges for part in hinge.parts)
        p = self.parameters
        return Body(
            parts=self.chassis(p.mass - rolling),
            joints=hinges,
            sensors=self.senses,
            height=p.wheel_radius,
        )

    def chassis(self, mass: float) -> tuple[Part, ...]:
        """Return all parts except the wheels; their masses add up to `mass`, kg."""
        raise NotImplementedError(f"{type(self).__name__} must define chassis().")

    def wheels(self) -> tuple[Hinge, ...]:
        """Return the wheels: a pair, on one axle through the origin."""
        return self.pair(0.0)

    def pair(self, x: float, z: float = 0.0, slave: str = "") -> tuple[Hinge, Hinge]:
        """Return a left and a right wheel, on an axle at `x` and `z`, m.

        slave: name of further wheels that obey the first pair's command; "" for the
            first pair, whose angles are in the state
        """
        side = self.parameters.track / 2
        return (
            self._wheel("wheel/left", slave, (x, side, z)),
            self._wheel("wheel/right", slave, (x, -side, z)),
        )

    def tyre(self) -> tuple[Part, ...]:
        """Return the parts of a wheel."""
        radius, friction = self.parameters.wheel_radius, self.parameters.wheel_friction
        across, half = (0.0, 1.0, 0.0), self.wheel_mass / 2
        tread = Cylinder(radius, TREAD * radius, axis=across)
        tyre = Cylinder(SHOULDER * radius, self.wheel_width, axis=across)
        return Part(tread, half, friction=friction), Part(tyre, half, friction=friction)

    def _wheel(self, told: str, slave: str, at: Vector) -> Hinge:
        p = self.parameters
        return Hinge(
            f"{told}/{slave}" if slave else told,
            self.tyre(),
            at=at,
            axis=(0.0, 1.0, 0.0),
            torque=p.wheel_torque,
            droop=self.droop * p.max_wheel_speed,
            armature=self.gears,
            command=told,
            position=told if self.angles and not slave else "",
        )

    def arena(self) -> Arena:
        """Return the arena: an open floor, or a round wall."""
        return Arena(self.parameters.arena_radius, wall_height=0.5)

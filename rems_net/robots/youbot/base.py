"""KUKA's base on four mecanum wheels."""

from functools import cached_property
from typing import Any, ClassVar

from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.robot import Definition
from rems_net.bodies.body import Body
from rems_net.bodies.devices import Devices, Motor, Reading
from rems_net.defdict import DefDict, Schema, angle, angular_velocity, length, velocity
from rems_net.kinematics.arm import Mechanism
from rems_net.kinematics.wheels import Twist, mecanum, mecanum_speeds, slowed
from rems_net.maths import sincos
from rems_net.robots.pose import pose
from rems_net.robots.youbot.body import base

SIDES = ("left", "right")
#: paths of the wheels, in the order of their kinematics
WHEELS = tuple(f"wheel/{end}/{side}" for end in ("front", "rear") for side in SIDES)
#: fields of the base's velocity: ahead, to the left, and counter-clockwise
TWIST = ("linear/x", "linear/y", "angular/z")


def _twist(parameters: DefDict) -> Schema:
    """Return the command's schema, with ROS's names; ranges as the wheels allow."""
    p = parameters
    rim = p.wheel_radius * p.max_wheel_speed
    turn = rim / ((p.wheelbase + p.track) / 2)
    return Schema(
        "youbot.command",
        {
            "linear/x": velocity(range=(-rim, rim), doc="ahead"),
            "linear/y": velocity(range=(-rim, rim), doc="to the left"),
            "angular/z": angular_velocity(range=(-turn, turn), doc="counter-clockwise"),
        },
    )


class YoubotBase(Definition):
    """A base on four mecanum wheels, which also goes sideways.

    Frame: the origin is the middle between the wheels, as high as their axles; x ahead,
    y left, z up. The heading is counted from +x of the arena, counter-clockwise, and
    goes on past a full turn. A positive wheel speed drives ahead.

    The command is the base's velocity, as in KUKA's driver and in ROS's
    `mecanum_drive_controller`, and not four wheel speeds: only three of these are free,
    and with others the wheels slip. If a wheel would have to turn faster than it can,
    the base moves along the same curve, but slower.
    """

    tolerance: ClassVar[float] = 0.02
    integrator = "euler"  # as in the class's model

    parameters = Settings(
        wheel_radius=length(
            default=0.05, range=(0.001, 1), doc="URDF, Webots; KUKA's driver has 0.0475"
        ),
        wheelbase=length(default=0.456, range=(0.01, 10), doc="axle to axle; URDF"),
        track=length(default=0.316, range=(0.01, 10), doc="left to right wheel; URDF"),
        max_wheel_speed=angular_velocity(
            default=14.81, range=(0.01, 1000), doc="Webots, 0.74 m/s; KUKA has 0.8 m/s"
        ),
    )

    command = In(_twist)
    state = Out(
        Schema(
            "youbot_base.state",
            {
                **pose("the middle between the wheels"),
                **dict.fromkeys(
                    WHEELS, angle(doc="since the start, positive ahead, not wrapped")
                ),
            },
        )
    )

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        """Return each state field's rate, per second, for wheels that do not slip."""
        twist, speeds = self._going(command)
        s, c = sincos(state["heading"])
        return {
            "x": twist.x * c - twist.y * s,
            "y": twist.x * s + twist.y * c,
            "heading": twist.turn,
            **dict(zip(WHEELS, speeds, strict=True)),
        }

    def motor_command(self, command: DefDict) -> DefDict:
        """Return the command with the wheels' speeds for it, rad/s."""
        _, speeds = self._going(command)
        turning = dict(zip(WHEELS, speeds, strict=True))
        told = self._motors()
        told.clip(command.flat() | turning)
        return told

    @cached_property
    def _motors(self) -> Schema:
        top = self.parameters.max_wheel_speed
        speed = angular_velocity(range=(-top, top), doc="positive ahead")
        wheels = Schema("youbot.wheels", dict.fromkeys(WHEELS, speed))
        return self.command.schema.merge(wheels)

    def _going(self, command: DefDict) -> tuple[Twist, tuple[Any, ...]]:
        """Return the base's velocity and its wheels' speeds, none above its limit."""
        x, y, turn = (command[path] for path in TWIST)
        p = self.parameters
        radius, wheelbase, track = p.wheel_radius, p.wheelbase, p.track
        # In one of the four wheels, all three terms have the same sign.
        fastest = abs(x) + abs(y) + abs(turn) * ((wheelbase + track) / 2)
        twist = slowed(Twist(x, y, turn), fastest, radius * p.max_wheel_speed)
        return twist, mecanum_speeds(twist, radius, wheelbase, track)

    def mechanisms(self) -> dict[str, Mechanism]:
        """Return the kinematics of the base."""
        p = self.parameters
        top = p.max_wheel_speed
        wheels = mecanum(WHEELS, p.wheel_radius, p.wheelbase, p.track, top)
        return {"base": wheels}

    def body(self) -> Body:
        """Return the base's body: a box on four wheels with rollers."""
        p = self.parameters
        return base(WHEELS, p.wheel_radius, p.wheelbase, p.track)

    def webots(self) -> Devices:
        """Return the wheels' names in Webots' Youbot; right ones come first there."""
        names = dict(zip(WHEELS, ("wheel2", "wheel1", "wheel4", "wheel3"), strict=True))
        return Devices(
            motors=tuple(Motor(name, path) for path, name in names.items()),
            readings=tuple(
                Reading(path, f"{name}sensor", counted=True, port="state")
                for path, name in names.items()
            ),
            origin=(0.0, 0.0, -0.055),
        )

"""youBot: KUKA's base on four mecanum wheels, its arm, and the two together."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from math import pi, radians
from typing import Any, ClassVar

from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.robot import Definition
from rems_net.agents.verbs import verb
from rems_net.defdict import (
    DefDict,
    Schema,
    angle,
    angular_velocity,
    length,
    ratio,
    velocity,
)
from rems_net.kinematics.mechanism import Mechanism
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.servo import speed_toward, toward
from rems_net.kinematics.upright import Proportions, UprightArm
from rems_net.kinematics.wheels import Twist, mecanum, mecanum_speeds, slowed
from rems_net.maths import sincos
from rems_net.robots.youbot_body import FINGER_SPEED, FINGER_TRAVEL, arm, base
from rems_net.worlds.body import Body, Vector
from rems_net.worlds.devices import Devices, Motor, Reading
from rems_net.worlds.noise import Noise

SIDES = ("left", "right")
#: The wheels, in the order of their kinematics.
WHEELS = tuple(f"wheel/{end}/{side}" for end in ("front", "rear") for side in SIDES)
#: How the base goes: ahead, to the left, and counter-clockwise.
TWIST = ("linear/x", "linear/y", "angular/z")
#: Paths of the arm's joints, from the foot to the hand.
JOINTS = tuple(f"arm/joint/{number}" for number in range(1, 6))
#: Their stops, degrees from upright, positive ahead (and counter-clockwise): KUKA's
#: data sheet; its URDF has the same, counted from folded.
STOPS = ((-169, 169), (-65, 90), (-151, 146), (-102.5, 102.5), (-167.5, 167.5))
#: How often the arm's motors turn for a turn of its joints: KUKA's driver.
GEAR_RATIOS = (156.0, 156.0, 100.0, 71.0, 71.0)
#: KUKA's Denavit-Hartenberg parameters: upright its tool is 0.6545 m high. The fifth
#: joint's place on the fourth link (0.130) is the URDF's.
PROPORTIONS = Proportions(
    height=0.147, ahead=0.033, upper=0.155, lower=0.135, wrist=0.130, tool=0.0875
)


def _twist(parameters: DefDict) -> Schema:
    """Return how to go, in the words of ROS; each alone as fast as the wheels can."""
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

    It is told how fast to go, as KUKA's driver is, and `mecanum_drive_controller` of
    ROS, and not how fast each wheel turns: of four speeds three are free, and wheels
    told anything else slip. Where a wheel would have to turn faster than it can, it
    goes the same way slower.
    """

    tolerance: ClassVar[float] = 0.02

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
                "x": length(doc="of the middle between the wheels"),
                "y": length(doc="of the middle between the wheels"),
                "heading": angle(doc="counter-clockwise from +x, not wrapped"),
                **dict.fromkeys(
                    WHEELS, angle(doc="since the start, positive ahead, not wrapped")
                ),
            },
        )
    )

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        """Return the rate of each field of the state, per second: wheels that roll."""
        twist, speeds = self._going(command)
        s, c = sincos(state["heading"])
        return {
            "x": twist.x * c - twist.y * s,
            "y": twist.x * s + twist.y * c,
            "heading": twist.turn,
            **dict(zip(WHEELS, speeds, strict=True)),
        }

    def motor_command(self, command: DefDict) -> DefDict:
        """Return the command, and how fast the wheels turn for it, rad/s."""
        _, speeds = self._going(command)
        turning = dict(zip(WHEELS, speeds, strict=True))
        return self._motors(self._motors().clip(command.flat() | turning))

    @cached_property
    def _motors(self) -> Schema:
        top = self.parameters.max_wheel_speed
        speed = angular_velocity(range=(-top, top), doc="positive ahead")
        wheels = Schema("youbot.wheels", dict.fromkeys(WHEELS, speed))
        return self.command.schema.merge(wheels)

    def _going(self, command: DefDict) -> tuple[Twist, tuple[Any, ...]]:
        """Return how it goes, and how fast its wheels turn, none above its top."""
        x, y, turn = (command[path] for path in TWIST)
        p = self.parameters
        radius, wheelbase, track = p.wheel_radius, p.wheelbase, p.track
        # One of the four has all three with the same sign.
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
        """Return what the base is made of: a box on four wheels with rollers."""
        p = self.parameters
        return base(WHEELS, p.wheel_radius, p.wheelbase, p.track)

    def webots(self) -> Devices:
        """Return what Webots' Youbot calls its wheels, right ones first."""
        names = dict(zip(WHEELS, ("wheel2", "wheel1", "wheel4", "wheel3"), strict=True))
        return Devices(
            motors=tuple(Motor(name, path) for path, name in names.items()),
            readings=tuple(
                Reading(path, f"{name}sensor", counted=True, port="state")
                for path, name in names.items()
            ),
            origin=(0.0, 0.0, -0.055),
        )


class YoubotArm(Definition):
    """An arm of five joints and a gripper.

    Frame: the origin is where its first axis meets the plate that it stands on; x
    ahead, y left, z up. At zero it is upright. Positive angles lean it ahead, and turn
    its foot and its hand counter-clockwise seen from above.

    It is told where its joints shall go, and how fast: at speed 0, which is what it
    obeys when nobody tells it anything, they hold where they are.
    """

    #: where its foot is in the robot's frame, m
    foot: ClassVar[Vector] = (0.0, 0.0, 0.0)

    parameters = Settings(
        joint_speed=angular_velocity(
            default=1.5708, range=(0.001, 100), doc="of a joint at speed 1; URDF"
        ),
    )

    command = In(
        Schema(
            "youbot_arm.command",
            {
                **{
                    path: angle(range=(radians(low), radians(high)), doc="to go to")
                    for path, (low, high) in zip(JOINTS, STOPS, strict=True)
                },
                "arm/gripper": length(
                    range=(0, FINGER_TRAVEL), doc="of each finger from closed"
                ),
                "arm/speed": ratio(
                    range=(0, 1), doc="how fast to go there; at 0 all joints hold"
                ),
            },
        )
    )
    state = Out(
        Schema(
            "youbot_arm.state",
            {
                **dict.fromkeys(JOINTS, angle(doc="from upright")),
                "arm/gripper": length(doc="of each finger from closed"),
            },
        )
    )
    sensors = Out(
        Schema(
            "youbot_arm.sensors",
            {path.replace("joint", "velocity"): angular_velocity() for path in JOINTS},
        )
    )

    def advance(self, state: DefDict, command: DefDict, dt: float) -> dict[str, Any]:
        """Return where joints and fingers are `dt` seconds later."""
        share = command["arm/speed"]
        most = share * self.parameters.joint_speed * dt
        gone = {path: toward(state[path], command[path], most) for path in JOINTS}
        gone["arm/gripper"] = toward(
            state["arm/gripper"], command["arm/gripper"], share * FINGER_SPEED * dt
        )
        return gone

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        """Return how fast the joints go."""
        speed = command["arm/speed"] * self.parameters.joint_speed
        return {
            path.replace("joint", "velocity"): speed_toward(
                state[path], command[path], speed
            )
            for path in JOINTS
        }

    def mechanisms(self) -> dict[str, Mechanism]:
        """Return the kinematics of the arm."""
        limits = [(radians(low), radians(high)) for low, high in STOPS]
        return {"arm": UprightArm(JOINTS, limits, PROPORTIONS, Pose.of(self.foot))}

    def noise(self) -> dict[str, Noise]:
        """Return how far the sensors are from the truth.

        KUKA's driver reads how fast a motor turns in whole revolutions per minute,
        before the gears.
        """
        return {
            path.replace("joint", "velocity"): Noise(step=2 * pi / 60 / gear)
            for path, gear in zip(JOINTS, GEAR_RATIOS, strict=True)
        }

    @verb
    def tool(self) -> dict[str, float]:
        """Return where its tool is, in its own frame: x, y, z in m, and rpy in rad."""
        told: dict[str, float] = self.fk(of="arm").told()
        return told

    def body(self) -> Body:
        """Return what the arm is made of; alone it is bolted to the floor."""
        return arm(JOINTS, STOPS, PROPORTIONS, self.foot, self.parameters.joint_speed)

    def webots(self) -> Devices:
        """Return what Webots' Youbot calls the joints of its arm.

        There a positive angle leans it back, and it leans ahead by 65 degrees at most.
        """
        signs = dict(zip(JOINTS, (1.0, -1.0, -1.0, -1.0, 1.0), strict=True))
        top, pace = self.parameters.joint_speed, "arm/speed"
        joints = [(path, f"arm{path[-1]}", sign) for path, sign in signs.items()]
        return Devices(
            motors=(
                *(Motor(d, path, sign, 0.0, pace, top) for path, d, sign in joints),
                # Coupled: it takes the right finger along.
                Motor("finger::left", "arm/gripper", pace=pace, top=FINGER_SPEED),
            ),
            readings=tuple(
                Reading(path, f"{device}sensor", factor=sign, port="state")
                for path, device, sign in joints
            ),
        )


class Youbot(YoubotBase, YoubotArm):
    """A youBot: the arm on the base."""

    # URDF: the arm's plate at (0.143, 0, 0.046) of a frame that is 0.084 m above the
    # floor, its first axis 0.024 m ahead, its second 0.115 m up.
    foot = (0.167, 0.0, 0.048)

    def body(self) -> Body:
        """Return what it is made of: the base, and the arm on it."""
        below, above = YoubotBase.body(self), YoubotArm.body(self)
        return replace(
            below,
            parts=below.parts + above.parts,
            joints=below.joints + above.joints,
            sensors=below.sensors + above.sensors,
        )

    def webots(self) -> Devices:
        """Return what Webots' Youbot calls its devices."""
        below, above = YoubotBase.webots(self), YoubotArm.webots(self)
        return replace(
            below,
            motors=below.motors + above.motors,
            readings=below.readings + above.readings,
        )

"""SCALER-M: two of the climbing robot SCALER's limbs, as arms on its body."""

from math import pi
from typing import Any, ClassVar

from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.robot import Definition
from rems_net.agents.verbs import verb
from rems_net.bodies.body import Body, Box, Part, Tachometer
from rems_net.bodies.noise import Noise
from rems_net.defdict import DefDict, Schema, angle, angular_velocity, ratio
from rems_net.kinematics.fivebar import FiveBarArm
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.servo import speed_toward, toward
from rems_net.robots import limb
from rems_net.robots.limb import JOINTS, STOPS, Limb, paths

#: the arms, and the legs of SCALER that they are: 0 (front, y positive) and 1
ARMS = ("left", "right")
#: rad. Positions of the joints, and their commands, at the start: the linkage reaches
#: out to the side.
BEGIN = (0.0, 0.0, pi / 2, 0.0, 0.0, 0.0)
#: kg, from SCALER's URDF; and m, the shoulders' height, a guess
BODY_MASS, HEIGHT = 0.536, 0.6


def _command() -> Schema:
    fields = {}
    for arm in ARMS:
        for path, (low, high), begin in zip(paths(arm), STOPS, BEGIN, strict=True):
            fields[path] = angle(range=(low, high), default=begin, doc="to go to")
        fields[f"{arm}/speed"] = ratio(
            range=(0, 1), doc="how fast to go there; at 0 all joints hold"
        )
    return Schema("scaler.command", fields)


def _state() -> Schema:
    fields = {
        path: angle(default=begin)
        for arm in ARMS
        for path, begin in zip(paths(arm), BEGIN, strict=True)
    }
    return Schema("scaler.state", fields)


class Scaler(Definition):
    """Two arms of six joints: a shoulder, a five-bar linkage, a wrist of three.

    Frame: the origin is the middle of the body, as high as the shoulders; x ahead, y
    left, z up. An arm's own frame has x outward. Its servos are at 0 when their links
    hang down, and swing them outward; the other angles are as in REMS.

    The command has the joints' target angles and a speed for each arm. At speed 0,
    the default, the joints hold their positions.
    """

    integrator = "euler"  # as the class's model
    #: the arms of this robot
    arms: ClassVar[tuple[str, ...]] = ARMS

    parameters = Settings(
        joint_speed=angular_velocity(
            default=5.445, range=(0.001, 100), doc="of a joint at speed 1; 52 rpm, REMS"
        ),
    )

    command = In(_command())
    state = Out(_state())
    sensors = Out(
        Schema(
            "scaler.sensors",
            {
                f"{arm}/velocity/{joint}": angular_velocity()
                for arm in ARMS
                for joint in JOINTS
            },
        )
    )

    def advance(self, state: DefDict, command: DefDict, dt: float) -> dict[str, Any]:
        """Return the joints' positions `dt` seconds later."""
        gone = {}
        for arm in self.arms:
            most = command[f"{arm}/speed"] * self.parameters.joint_speed * dt
            for path in paths(arm):
                gone[path] = toward(state[path], command[path], most)
        return gone

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        """Return the joints' speeds."""
        read = {}
        for arm in self.arms:
            speed = command[f"{arm}/speed"] * self.parameters.joint_speed
            for joint in JOINTS:
                path = f"{arm}/{joint}"
                going = speed_toward(state[path], command[path], speed)
                read[f"{arm}/velocity/{joint}"] = going
        return read

    def mechanisms(self) -> dict[str, FiveBarArm]:
        """Return the kinematics of the arms; their tools are the grippers."""
        arms: dict[str, FiveBarArm] = {}
        for arm in self.arms:
            x, y, turn = limb.SHOULDERS[arm]
            arms[arm] = FiveBarArm(
                paths(arm),
                STOPS,
                limb.BARS,
                hand=limb.HAND,
                base=Pose.of((x, y, 0.0), yaw=turn),
                tool=limb.GRIPPERS[arm],
            )
        return arms

    def noise(self) -> dict[str, Noise]:
        """Return the noise of the sensors.

        The servos measure speeds in steps of 0.229 rpm (XM430-W350 e-Manual).
        """
        return {"*/velocity/*": Noise(step=0.229 * 2 * pi / 60)}

    @verb
    def tool(self, arm: str = "") -> dict[str, float]:
        """Return the pose of an arm's gripper: x, y, z in m, and rpy in rad.

        arm: needed if there are two
        """
        told: dict[str, float] = self.fk(of=arm).told()
        return told

    def body(self) -> Body:
        """Return the robot's body: the arms on a box that does not move."""
        box = Part(Box((0.30, 0.25, 0.05)), BODY_MASS)
        sensors = tuple(
            Tachometer(f"{arm}/velocity/{joint}", f"{arm}/{joint}")
            for arm in self.arms
            for joint in JOINTS
        )
        arms = [Limb(arm, self.parameters.joint_speed) for arm in self.arms]
        return Body(
            (box,),
            tuple(arm.shoulder() for arm in arms),
            sensors,
            height=HEIGHT,
            fixed=True,
            loops=tuple(arm.loop() for arm in arms),
        )


class ScalerLeft(Scaler):
    """SCALER's left arm alone, on the same body, with the same frame and figures.

    Its joints have the same paths as in the whole robot, so a program that commands
    its left arm can command this one. Gripper and servos are the left arm's.
    """

    arms = ("left",)
    command = In(Scaler.command.schema.slice("left", name="scaler_left.command"))
    state = Out(Scaler.state.schema.slice("left", name="scaler_left.state"))
    sensors = Out(Scaler.sensors.schema.slice("left", name="scaler_left.sensors"))

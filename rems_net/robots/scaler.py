"""SCALER-M: two of the climbing robot SCALER's limbs, as arms on its body."""

from __future__ import annotations

from math import asin, pi
from typing import Any

import numpy as np

from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.robot import Definition
from rems_net.defdict import DefDict, Schema, angle, angular_velocity, ratio
from rems_net.kinematics.fivebar import FiveBar, FiveBarArm
from rems_net.kinematics.mechanism import Mechanism
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.servo import speed_toward, toward

#: The arms, and the legs of SCALER that they are: 0 (front, y positive) and 1.
ARMS = ("left", "right")
#: The joints of an arm, in the order of the original's q1, q11, q21, q4, q5, q6.
JOINTS = ("shoulder", "top", "bottom", "wrist/1", "wrist/2", "wrist/3")
#: Where they may go, rad. None is published: all are guesses. The top servo's highest
#: is chosen: from 1.234 on the elbows can meet, where the linkage does not close.
STOPS = ((-1.2, 1.2), (-1.57, 1.2), (0.0, pi), (-pi, pi), (-1.9, 1.9), (-pi, pi))
#: Where a joint is, and is told to go, before anything else is said: there the
#: linkage reaches out to the side.
BEGIN = (0.0, 0.0, pi / 2, 0.0, 0.0, 0.0)
#: Lengths of the linkage, m: the original's constants for six joints and a gripper.
BARS = FiveBar(
    ahead=-0.01057,
    top=-0.07125,
    bottom=-0.09975,
    crank=0.113,
    upper=0.142035,
    lower=0.13635,
    tip=0.21505,
    bent=asin(0.03675 / 0.142035),
)
#: Where the shoulders are on the body, and how their frames are turned about z.
SHOULDERS = {"left": (0.136, 0.144, pi / 2), "right": (0.136, -0.144, -pi / 2)}
#: The wrist's frame on a plate that hangs down, and the gripper in the wrist's frame.
HAND = Pose(
    np.zeros(3), np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
)
GRIPPERS = {
    "left": Pose(np.array([-0.030, -0.0625, 0.0995]), np.diag([-1.0, -1.0, 1.0])),
    "right": Pose.of((0.030, -0.0625, 0.0995)),
}


def paths(arm: str) -> list[str]:
    """Return the paths of an arm's joints, in order."""
    return [f"{arm}/{joint}" for joint in JOINTS]


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
    left, z up. An arm's own frame has x outward. Its servos are at 0 where their links
    hang down, and swing them outward; the other angles are the original's.

    An arm is told where its joints shall go, and how fast: at speed 0, which is what
    it obeys when nobody tells it anything, they hold where they are.
    """

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
        """Return where the joints are `dt` seconds later."""
        gone = {}
        for arm in ARMS:
            most = command[f"{arm}/speed"] * self.parameters.joint_speed * dt
            for path in paths(arm):
                gone[path] = toward(state[path], command[path], most)
        return gone

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        """Return how fast the joints go."""
        read = {}
        for arm in ARMS:
            speed = command[f"{arm}/speed"] * self.parameters.joint_speed
            for joint in JOINTS:
                path = f"{arm}/{joint}"
                going = speed_toward(state[path], command[path], speed)
                read[f"{arm}/velocity/{joint}"] = going
        return read

    def mechanisms(self) -> dict[str, Mechanism]:
        """Return the kinematics of both arms; their tools are the grippers."""
        arms: dict[str, Mechanism] = {}
        for arm, (x, y, turn) in SHOULDERS.items():
            arms[arm] = FiveBarArm(
                paths(arm),
                STOPS,
                BARS,
                hand=HAND,
                base=Pose.of((x, y, 0.0), yaw=turn),
                tool=GRIPPERS[arm],
            )
        return arms

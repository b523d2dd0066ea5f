"""Arms to try: those of the robots, and one as a student may build it."""

from collections.abc import Callable
from math import pi

import numpy as np

from rems_net.kinematics.arm import Arm
from rems_net.kinematics.chain import Chain, ChainJoint
from rems_net.kinematics.fivebar import FiveBarArm
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.rotation import Array
from rems_net.kinematics.upright import UprightArm
from rems_net.robots.scaler import Scaler
from rems_net.robots.youbot import Youbot, YoubotArm


def youbot(robot: type[YoubotArm] = YoubotArm) -> UprightArm:
    arm = robot("arm").mechanisms()["arm"]
    assert isinstance(arm, UprightArm)
    return arm


def scaler(side: str = "left") -> FiveBarArm:
    arm = Scaler("scaler").mechanisms()[side]
    assert isinstance(arm, FiveBarArm)
    return arm


def crane() -> Chain:
    """Six joints in a row, one of which slides, with no closed form."""
    slant = (0.6, 0.0, 0.8)
    joints = [
        ChainJoint("turn", (0.0, 0.1, 0.2), (0.0, 0.0, 1.0), -pi, pi),
        ChainJoint("lift", (0.1, 0.0, 0.3), (0.0, 1.0, 0.0), -1.5, 1.5),
        ChainJoint("boom", (0.0, 0.0, 0.3), slant, -0.1, 0.3, slides=True),
        ChainJoint("tilt", (0.05, 0.0, 0.3), (0.0, 1.0, 0.0), -2.0, 2.0),
        ChainJoint("roll", (0.0, 0.02, 0.1), slant, -2.5, 2.5),
        ChainJoint("yaw", (0.0, 0.0, 0.1), (1.0, 0.0, 0.0), -2.0, 2.0),
    ]
    tool = Pose.of((0.01, 0.02, 0.1), roll=0.3, pitch=-0.4, yaw=0.5)
    return Chain(joints, base=Pose.of((0.2, -0.1, 0.1), yaw=0.7), tool=tool)


#: all that can be made, by name
ARMS: dict[str, Callable[[], Arm]] = {
    "youbot_arm": youbot,
    "youbot": lambda: youbot(Youbot),
    "scaler left": scaler,
    "scaler right": lambda: scaler("right"),
    "crane": crane,
}


def anywhere(arm: Arm, random: np.random.Generator) -> list[float]:
    """Joints within their stops."""
    found: Array = arm.low + (arm.high - arm.low) * random.random(len(arm.low))
    return [float(angle) for angle in found]

"""youBot: KUKA's base on four mecanum wheels, its arm, and the two together."""

from rems_net.robots.youbot.arm import JOINTS, PROPORTIONS, STOPS, YoubotArm
from rems_net.robots.youbot.base import TWIST, WHEELS, YoubotBase
from rems_net.robots.youbot.whole import Youbot

__all__ = [
    "JOINTS",
    "PROPORTIONS",
    "STOPS",
    "TWIST",
    "WHEELS",
    "Youbot",
    "YoubotArm",
    "YoubotBase",
]

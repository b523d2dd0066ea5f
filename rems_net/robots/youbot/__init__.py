"""youBot: KUKA's base on four mecanum wheels, its arm, and the two together."""

from rems_net.robots.youbot.arm import (
    JOINTS as JOINTS,
    PROPORTIONS as PROPORTIONS,
    STOPS as STOPS,
    YoubotArm as YoubotArm,
)
from rems_net.robots.youbot.base import (
    TWIST as TWIST,
    WHEELS as WHEELS,
    YoubotBase as YoubotBase,
)
from rems_net.robots.youbot.whole import Youbot as Youbot

"""youBot: KUKA's base on four mecanum wheels, its arm, and the two together."""

from rems_net.robots.youbot.arm import JOINTS as JOINTS
from rems_net.robots.youbot.arm import PROPORTIONS as PROPORTIONS
from rems_net.robots.youbot.arm import STOPS as STOPS
from rems_net.robots.youbot.arm import YoubotArm as YoubotArm
from rems_net.robots.youbot.base import TWIST as TWIST
from rems_net.robots.youbot.base import WHEELS as WHEELS
from rems_net.robots.youbot.base import YoubotBase as YoubotBase
from rems_net.robots.youbot.whole import Youbot as Youbot

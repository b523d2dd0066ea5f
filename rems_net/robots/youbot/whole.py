"""A youBot: the arm on the base."""

from dataclasses import replace

from rems_net.bodies.body import Body
from rems_net.bodies.devices import Devices
from rems_net.robots.youbot.arm import YoubotArm
from rems_net.robots.youbot.base import YoubotBase


class Youbot(YoubotBase, YoubotArm):
    """A youBot: the arm on the base."""

    # URDF: the arm's plate at (0.143, 0, 0.046) of a frame that is 0.084 m above the
    # floor, its first axis 0.024 m ahead, its second 0.115 m up.
    foot = (0.167, 0.0, 0.048)

    def body(self) -> Body:
        """Return the whole body: the base, and the arm on it."""
        below, above = YoubotBase.body(self), YoubotArm.body(self)
        return replace(
            below,
            parts=below.parts + above.parts,
            joints=below.joints + above.joints,
            sensors=below.sensors + above.sensors,
        )

    def webots(self) -> Devices:
        """Return the devices' names in Webots' Youbot."""
        below, above = YoubotBase.webots(self), YoubotArm.webots(self)
        return replace(
            below,
            motors=below.motors + above.motors,
            readings=below.readings + above.readings,
        )

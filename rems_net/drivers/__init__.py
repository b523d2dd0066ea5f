"""Drivers: run robots as equations, in physics engines, or on hardware.

from rems_net.drivers import Kinematic, combine
robot_class = combine(Woodbot, Kinematic)

A driver imports no definition.
"""

from typing import TYPE_CHECKING

from rems_net.doors import door

if TYPE_CHECKING:
    from rems_net.agents.robot import combine as combine
    from rems_net.drivers.hardware.driven import Driven as Driven
    from rems_net.drivers.hardware.serial import SerialDriven as SerialDriven
    from rems_net.drivers.kinematic.kinematic import Kinematic as Kinematic
    from rems_net.drivers.physics.mujoco import Mujoco as Mujoco
    from rems_net.drivers.physics.pybullet import Pybullet as Pybullet
    from rems_net.drivers.remote import Remote as Remote
    from rems_net.drivers.webots.webots import Webots as Webots
    from rems_net.emulators.known import emulated as emulated

__getattr__, __dir__ = door(__name__)

"""Drivers: run robots as equations, in physics engines, or on hardware.

from rems_net.drivers import Kinematic, combine
robot_class = combine(Woodbot, Kinematic)

A driver imports no definition.
"""

from typing import TYPE_CHECKING

from rems_net.doors import door

if TYPE_CHECKING:
    from rems_net.agents.robot import combine
    from rems_net.drivers.hardware.driven import Driven
    from rems_net.drivers.hardware.serial import SerialDriven
    from rems_net.drivers.kinematic.kinematic import Kinematic
    from rems_net.drivers.physics.mujoco import Mujoco
    from rems_net.drivers.physics.pybullet import Pybullet
    from rems_net.drivers.remote import Remote
    from rems_net.drivers.webots.webots import Webots
    from rems_net.emulators.known import emulated

#: public names by the module that defines them
_HOMES = {
    "rems_net.agents.robot": "combine",
    "rems_net.drivers.hardware.driven": "Driven",
    "rems_net.drivers.hardware.serial": "SerialDriven",
    "rems_net.drivers.kinematic.kinematic": "Kinematic",
    "rems_net.drivers.physics.mujoco": "Mujoco",
    "rems_net.drivers.physics.pybullet": "Pybullet",
    "rems_net.drivers.remote": "Remote",
    "rems_net.drivers.webots.webots": "Webots",
    "rems_net.emulators.known": "emulated",
}

__all__ = [
    "Driven",
    "Kinematic",
    "Mujoco",
    "Pybullet",
    "Remote",
    "SerialDriven",
    "Webots",
    "combine",
    "emulated",
]

__getattr__, __dir__ = door(__name__, _HOMES)

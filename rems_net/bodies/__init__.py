"""Bodies: parts of robots: boxes, joints, sensors, chains, noise.

from rems_net.bodies import Body, Box, Cylinder, Hinge, Part

This room imports no physics engine.
"""

from typing import TYPE_CHECKING

from rems_net.doors import door

if TYPE_CHECKING:
    from rems_net.bodies.actuators import actuation as actuation
    from rems_net.bodies.body import (
        Accelerometer as Accelerometer,
        Arena as Arena,
        Body as Body,
        Box as Box,
        Camera as Camera,
        Compass as Compass,
        Cylinder as Cylinder,
        Driven as Driven,
        Encoder as Encoder,
        Gyro as Gyro,
        Hinge as Hinge,
        Loop as Loop,
        Lump as Lump,
        Model as Model,
        Part as Part,
        Ray as Ray,
        Sensor as Sensor,
        Servo as Servo,
        Shape as Shape,
        Slide as Slide,
        Source as Source,
        Sphere as Sphere,
        Switch as Switch,
        Tachometer as Tachometer,
        Wall as Wall,
        lump as lump,
    )
    from rems_net.bodies.devices import (
        Devices as Devices,
        Motor as Motor,
        Reading as Reading,
    )
    from rems_net.bodies.noise import Noise as Noise
    from rems_net.kinematics.chain import Chain as Chain, ChainJoint as ChainJoint
    from rems_net.kinematics.pose import Pose as Pose
    from rems_net.kinematics.servo import toward as toward
    from rems_net.robots.differential import figures as figures
    from rems_net.robots.sensing import sensed as sensed

__getattr__, __dir__ = door(__name__)

"""Bodies: parts of robots: boxes, joints, sensors, chains, noise.

from rems_net.bodies import Body, Box, Cylinder, Hinge, Part

This room imports no physics engine.
"""

from typing import TYPE_CHECKING

from rems_net.doors import door

if TYPE_CHECKING:
    from rems_net.bodies.actuators import actuation
    from rems_net.bodies.body import (
        Accelerometer,
        Arena,
        Body,
        Box,
        Camera,
        Compass,
        Cylinder,
        Driven,
        Encoder,
        Gyro,
        Hinge,
        Loop,
        Lump,
        Model,
        Part,
        Ray,
        Sensor,
        Servo,
        Shape,
        Slide,
        Source,
        Sphere,
        Switch,
        Tachometer,
        Wall,
        lump,
    )
    from rems_net.bodies.devices import Devices, Motor, Reading
    from rems_net.bodies.noise import Noise
    from rems_net.kinematics.chain import Chain, ChainJoint
    from rems_net.kinematics.pose import Pose
    from rems_net.kinematics.servo import toward
    from rems_net.robots.differential import figures
    from rems_net.robots.sensing import sensed

#: public names by the module that defines them
_HOMES = {
    "rems_net.bodies.actuators": "actuation",
    "rems_net.bodies.body": (
        "Accelerometer Arena Body Box Camera Compass Cylinder Driven Encoder Gyro "
        "Hinge Loop Lump Model Part Ray Sensor Servo Shape Slide Source Sphere "
        "Switch Tachometer Wall lump"
    ),
    "rems_net.bodies.devices": "Devices Motor Reading",
    "rems_net.bodies.noise": "Noise",
    "rems_net.kinematics.chain": "Chain ChainJoint",
    "rems_net.kinematics.pose": "Pose",
    "rems_net.kinematics.servo": "toward",
    "rems_net.robots.differential": "figures",
    "rems_net.robots.sensing": "sensed",
}

__all__ = [
    "Accelerometer",
    "Arena",
    "Body",
    "Box",
    "Camera",
    "Chain",
    "ChainJoint",
    "Compass",
    "Cylinder",
    "Devices",
    "Driven",
    "Encoder",
    "Gyro",
    "Hinge",
    "Loop",
    "Lump",
    "Model",
    "Motor",
    "Noise",
    "Part",
    "Pose",
    "Ray",
    "Reading",
    "Sensor",
    "Servo",
    "Shape",
    "Slide",
    "Source",
    "Sphere",
    "Switch",
    "Tachometer",
    "Wall",
    "actuation",
    "figures",
    "lump",
    "sensed",
    "toward",
]

__getattr__, __dir__ = door(__name__, _HOMES)

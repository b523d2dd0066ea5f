"""Woodbot: two servo wheels and a tail under a wooden board, as built in class."""

from functools import partial
from typing import Any

from rems_net.agents.ports import In, Out, Settings
from rems_net.bodies.actuators import actuation
from rems_net.bodies.body import (
    Arena,
    Body,
    Box,
    Compass,
    Cylinder,
    Gyro,
    Part,
    Ray,
    Sphere,
)
from rems_net.bodies.devices import Devices, Reading, two_sides
from rems_net.bodies.noise import Noise
from rems_net.defdict import (
    DefDict,
    Schema,
    angular_velocity,
    length,
    mass,
    number,
    torque,
)
from rems_net.maths import sincos
from rems_net.robots.differential import Differential, wheel_speeds
from rems_net.robots.pose import pose
from rems_net.robots.sensing import to_wall

# The same in all Woodbots (m, kg), from the class's CAD mesh.
BOARD = (0.0900, 0.0792, 0.0030)
BOARD_AT = (-0.03075, 0.0, 0.0078)
BOARD_MASS = 0.015
LOAD = (0.030, 0.060, 0.020)
LOAD_HEIGHT = 0.0063
TAIL_TIP = 0.0030
TAIL_MASS = 0.001
SENSOR_HEIGHT = 0.0063


class Woodbot(Differential):
    """A two-wheeled robot that turns by driving its wheels at different speeds.

    Frame: the origin is the middle of the axle; x ahead, y left, z up. The heading is
    counted from +x of the arena, counter-clockwise, and goes on past a full turn.
    A positive wheel speed drives ahead. Sources: docs/woodbot.md.
    """

    wheel_width, wheel_mass = 0.0030, 0.00225
    gears = 1e-5  # a guess, small beside the 2.4e-5 that the robot's mass adds
    droop = 1.0  # plain DC motors, without speed control
    angles = False

    parameters = Settings(
        wheel_radius=length(default=0.020, range=(0.001, 1), doc="CAD mesh"),
        track=length(
            default=0.1126, range=(0.001, 1), doc="between the wheels; CAD mesh"
        ),
        max_wheel_speed=angular_velocity(
            default=7.3,
            range=(0.01, 100),
            doc="at 100 %; servo and battery decide, 6.8 to 8; fitted to Webots",
        ),
        mass=mass(default=0.12, range=(0.03, 10), doc="in all; weighed (Lab 4)"),
        centre_of_mass=length(
            default=-0.01575,
            range=(-0.07, 0.02),
            doc="ahead of the axle; behind it is negative; the class's Webots world",
        ),
        wheel_torque=torque(
            default=0.1275, range=(1e-4, 10), doc="FS90R servo stalled at 4.8 V"
        ),
        wheel_friction=number(default=0.8, range=(0, 5), doc="Coulomb; Webots world"),
        tail_friction=number(default=0.01, range=(0, 5), doc="Coulomb; Webots world"),
        tail=length(default=0.0708, range=(0.02, 1), doc="behind the axle; CAD mesh"),
        lidar_front=length(
            default=0.00825, range=(-1, 1), doc="of its lens ahead of the axle"
        ),
        lidar_right=length(
            default=-0.03575, range=(-1, 1), doc="of its lens ahead of the axle"
        ),
        lidar_reach=length(default=1.2, range=(0.01, 100), doc="reads this beyond it"),
        arena_radius=length(
            default=0.4, range=(0, 100), doc="of the round wall; 0 for none; Lab 1"
        ),
        actuation=actuation("wheel/left", "wheel/right"),
    )

    command = In(partial(wheel_speeds, name="woodbot.command"))
    state = Out(Schema("woodbot.state", pose("the middle of the axle")))
    sensors = Out(
        Schema(
            "woodbot.sensors",
            {
                "lidar": {
                    "front": length(doc="to the wall ahead"),
                    "right": length(doc="to the wall on the right"),
                },
                "compass": {
                    "x": number(doc="of the unit vector to the north (arena's +y)"),
                    "y": number(doc="of it to the robot's left"),
                },
                "gyro": {"z": angular_velocity(doc="counter-clockwise")},
            },
        )
    )

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        """Return the sensors' values in this state, without noise."""
        p = self.parameters
        x, y, heading = state["x"], state["y"], state["heading"]
        s, c = sincos(heading)
        front, right = p.lidar_front, p.lidar_right
        wall, reach = p.arena_radius, p.lidar_reach
        return {
            "lidar/front": to_wall(x + front * c, y + front * s, c, s, wall, reach),
            "lidar/right": to_wall(x + right * c, y + right * s, s, -c, wall, reach),
            "compass/x": s,
            "compass/y": c,
            "gyro/z": self.turning(command),
        }

    def tyre(self) -> tuple[Part, ...]:
        """Return the part of a wheel: a disc so thin that it needs no tread."""
        p = self.parameters
        disc = Cylinder(p.wheel_radius, self.wheel_width, axis=(0.0, 1.0, 0.0))
        return (Part(disc, self.wheel_mass, friction=p.wheel_friction),)

    def body(self) -> Body:
        """Return the robot's parts, wheels and sensors.

        The load (battery, servos, electronics) is placed so that the whole robot has
        the mass and the centre of mass of the parameters.
        """
        p = self.parameters
        tail_at = (-p.tail, 0.0, TAIL_TIP - p.wheel_radius)
        load = p.mass - BOARD_MASS - TAIL_MASS - 2 * self.wheel_mass
        moment = p.mass * p.centre_of_mass
        moment -= BOARD_MASS * BOARD_AT[0] + TAIL_MASS * tail_at[0]
        load_at = (moment / load, 0.0, LOAD_HEIGHT)

        ahead, left, up = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
        front = (p.lidar_front, 0.0, SENSOR_HEIGHT)
        right = (p.lidar_right, 0.0, SENSOR_HEIGHT)
        return Body(
            parts=(
                Part(Box(BOARD), BOARD_MASS, BOARD_AT, p.wheel_friction),
                Part(Sphere(TAIL_TIP), TAIL_MASS, tail_at, p.tail_friction),
                Part(Box(LOAD), load, load_at, friction=None),
            ),
            joints=self.wheels(),
            sensors=(
                Ray("lidar/front", front, ahead, p.lidar_reach),
                Ray("lidar/right", right, (0.0, -1.0, 0.0), p.lidar_reach),
                Compass("compass/x", ahead),
                Compass("compass/y", left),
                Gyro("gyro/z", up),
            ),
            height=p.wheel_radius,
        )

    def arena(self) -> Arena:
        """Return the arena: a round wall 0.1 m high."""
        return Arena(self.parameters.arena_radius, wall_height=0.1)

    def webots(self) -> Devices:
        """Return the devices' names in the class's world: motor_r is on the left."""
        return Devices(
            motors=two_sides(["motor_r"], ["motor_l"]),
            readings=(
                Reading("lidar/front", "lidar_f", factor=0.001),
                Reading("lidar/right", "lidar_r", factor=0.001),
                Reading("compass/x", "mag_x", part=0),
                Reading("compass/y", "mag_y", part=2, factor=-1.0),
                Reading("gyro/z", "gyro_z", part=1),
            ),
            origin=(-0.01425, -0.0063, 0.0),  # the model's origin is on its front edge
        )

    def noise(self) -> dict[str, Noise]:
        """Return the noise of the sensors.

        The lidars' noise is that of the class's Webots world; the rest is a guess.
        """
        return {
            "lidar/*": Noise(relative=0.04),
            "compass/*": Noise(absolute=0.03),
            "gyro/z": Noise(absolute=0.0035, bias=0.05),
        }

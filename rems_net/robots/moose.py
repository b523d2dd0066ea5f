"""Moose: Clearpath's vehicle of eight wheels."""

from rems_net.agents.ports import Out
from rems_net.bodies.body import Box, Compass, Gyro, Part
from rems_net.bodies.devices import Devices, Reading, two_sides
from rems_net.bodies.noise import Noise
from rems_net.robots.differential import ENCODERS, figures
from rems_net.robots.sensing import sensed
from rems_net.robots.skid_steered import SkidSteered

ROS = "moose_description of Clearpath's ROS packages"
#: m. Size of the chassis.
LENGTH, WIDTH, HEIGHT = 2.9532, 1.416, 0.527


class Moose(SkidSteered):
    """The Clearpath Moose: a car's weight on eight wheels, six of them slaves.

    On an even floor the four wheels in the middle carry it; those in front and behind
    are a centimetre higher, for slopes. That is a guess: such vehicles do so to be able
    to turn. On all eight wheels, spread over 2 m, friction would nearly prevent it. So
    it turns as if on two wheels 1.612 m apart. The real one steers by a double
    differential, and its controller in ROS uses 1.3468 m. Compass and gyro are an
    extension in the slot of Webots' robot.
    """

    axles = ((1.0036, 0.01), (0.3364, 0.0), (-0.3364, 0.0), (-1.0112, 0.01))  # ROS
    tolerance = 0.08
    # By Coulomb friction alone, it turns 7.5 % too late in half a second.
    eases = 1.0
    senses = (
        *ENCODERS,
        Compass("compass/x", (1.0, 0.0, 0.0)),
        Compass("compass/y", (0.0, 1.0, 0.0)),
        Gyro("gyro/z", (0.0, 0.0, 1.0)),
    )
    wheel_width, wheel_mass = 0.303, 16.8  # ROS
    # Guesses. Such wheels are as hard to move along as across, and friction acts
    # against the slip in both engines (docs/robots.md).
    gears, droop = 120.0, 0.0005

    parameters = figures(
        wheel_radius=(0.3175, ROS),
        track=(1.2498, f"between the wheels; {ROS}"),
        effective_track=(
            1.612,
            "of the wheels that bear it, by friction; 1.3468 in ROS",
        ),
        max_wheel_speed=(26.0, "8.3 m/s; Webots' Moose"),
        mass=(1724.4, f"1590 kg and eight wheels of 16.8; {ROS}"),
        wheel_torque=(1000.0, "Webots' Moose"),
        wheel_friction=(0.4, "Coulomb; a guess, tyres on grass"),
    )
    sensors = Out(sensed("moose.sensors", senses, "a guess: Webots has a slot"))

    def chassis(self, mass: float) -> tuple[Part, ...]:
        """Return a hull between the wheels, and a deck over them."""
        deck = 0.15
        hull = (LENGTH, 0.9, HEIGHT - deck)
        low = 0.05  # of the hull's middle above the axles, m; a guess
        top = low + (HEIGHT - deck) / 2 + deck / 2
        return (
            Part(Box(hull), 0.8 * mass, (0.0, 0.0, low), 0.3),
            Part(Box((LENGTH, WIDTH, deck)), 0.2 * mass, (0.0, 0.0, top), 0.3),
        )

    def noise(self) -> dict[str, Noise]:
        """Return the noise of the sensors: none, since none is known."""
        return {}

    def webots(self) -> Devices:
        """Return the devices' names in Webots' Moose.

        Compass and gyro are those in the slot in Webots' demonstration.
        """
        return Devices(
            motors=two_sides(
                [f"left motor {number}" for number in range(1, 5)],
                [f"right motor {number}" for number in range(1, 5)],
            ),
            readings=(
                Reading("compass/x", "compass", part=0),
                Reading("compass/y", "compass", part=1),
                Reading("gyro/z", "gyro", part=2),
            ),
            origin=(-0.075, 0.0, -0.06),
        )

"""Dynabot: two DYNAMIXEL wheels and a caster, put together from what a lab has."""

from math import pi

from rems_net.agents.ports import Out
from rems_net.bodies.body import Box, Part, Sphere
from rems_net.bodies.noise import Noise
from rems_net.robots.differential import ENCODERS, Differential, figures
from rems_net.robots.sensing import sensed

SERVO = "XL430-W250 e-Manual"
#: m. Sizes of the plate between the wheels, and of the caster behind them: guesses.
PLATE = (0.14, 0.12, 0.05)
CASTER, BEHIND = 0.010, -0.08


class Dynabot(Differential):
    """A robot on two XL430-W250 servos, each with a wheel on its horn.

    Its dimensions are not published: those here are of the TurtleBot3 Burger, which
    has the same servos. Measure your own, and set them in its parameters.
    """

    senses = ENCODERS
    wheel_width, wheel_mass, gears = 0.018, 0.03, 2e-3  # guesses
    droop = 0.05  # a guess, too: with less, MuJoCo's wheels slip

    parameters = figures(
        wheel_radius=(0.033, "a guess, of the TurtleBot3 Burger"),
        track=(0.160, "between the wheels; a guess, of the TurtleBot3 Burger"),
        max_wheel_speed=(6.35, f"265 x 0.229 rpm, its Velocity Limit; {SERVO}"),
        mass=(1.0, "a guess, of the TurtleBot3 Burger"),
        wheel_torque=(1.4, f"stalled at 11.1 V; {SERVO}"),
        wheel_friction=(0.8, "Coulomb; a guess, rubber on a hard floor"),
    )
    sensors = Out(sensed("dynabot.sensors", senses, "0.088 degrees apart"))

    def chassis(self, mass: float) -> tuple[Part, ...]:
        """Return the plate, with the battery on it, and the caster."""
        light = 0.01
        plate = Part(Box(PLATE), mass - light, (-0.02, 0.0, 0.02), friction=0.3)
        low = CASTER - self.parameters.wheel_radius
        caster = Part(Sphere(CASTER), light, (BEHIND, 0.0, low), friction=0.0)
        return plate, caster

    def noise(self) -> dict[str, Noise]:
        """Return the noise of the sensors.

        The servos count 4096 steps a turn (e-Manual).
        """
        return {"encoder/*": Noise(step=2 * pi / 4096)}

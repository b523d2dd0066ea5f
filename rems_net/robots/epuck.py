"""Epuck: EPFL's small robot for classes, two stepper motors in a round body."""

from collections.abc import Iterator
from math import pi

from rems_net.agents.ports import Out
from rems_net.bodies.body import (
    Accelerometer,
    Box,
    Camera,
    Cylinder,
    Gyro,
    Part,
    Ray,
    Sphere,
)
from rems_net.bodies.devices import Devices, Reading, encoders, two_sides
from rems_net.bodies.noise import Noise
from rems_net.defdict import Schema, count
from rems_net.maths import hypot
from rems_net.robots.differential import ENCODERS, Differential, figures
from rems_net.robots.sensing import sensed

WEBOTS = "Webots' E-puck"
WHEEL = 0.020
#: places of the infrared sensors, x and y in m, 33 mm above the floor; they look out
PROXIMITY = (
    (0.030, -0.010),
    (0.022, -0.025),
    (0.000, -0.031),
    (-0.030, -0.015),
    (-0.030, 0.015),
    (0.000, 0.031),
    (0.022, 0.025),
    (0.030, 0.010),
)
#: of these sensors in Webots: counts, the distance in m, and the standard deviation of
#: the counts as a share of them; Webots has fractions of counts, a converter none
TABLE = (
    (4095, 0.0, 0.002),
    (2133, 0.005, 0.003),
    (1466, 0.01, 0.007),
    (601, 0.015, 0.0406),
    (384, 0.02, 0.01472),
    (235, 0.03, 0.0241),
    (158, 0.04, 0.0287),
    (120, 0.05, 0.04225),
    (104, 0.06, 0.03065),
    (67, 0.07, 0.04897),
)
COUNTS = tuple((counts, distance) for counts, distance, _ in TABLE)
REACH = TABLE[-1][1]


def _proximity(number: int) -> Ray:
    x, y = PROXIMITY[number]
    far = float(hypot(x, y))
    at, out = (x, y, 0.033 - WHEEL), (x / far, y / far, 0.0)
    return Ray(f"proximity/{number}", at, out, REACH)


def _spreads() -> Iterator[tuple[float, float]]:
    """Yield a distance, and the standard deviation of its measurement, m."""
    last = len(TABLE) - 1
    for n, (told, distance, share) in enumerate(TABLE):
        (more, near, _), (less, far, _) = TABLE[max(n - 1, 0)], TABLE[min(n + 1, last)]
        yield distance, share * told * (far - near) / (more - less)


#: The proximity sensors in the device's counts, from nothing near to touching.
COUNTED = Schema(
    "epuck.counted",
    {
        f"proximity/{number}": count(table=COUNTS, means="m", default=COUNTS[-1][0])
        for number in range(len(PROXIMITY))
    },
)


class Epuck(Differential):
    """The GCTronic e-puck: 7 cm across, with eight infrared sensors around it.

    The proximity sensors are in m. A port with the schema `Epuck.counted` gets them in
    the device's counts. In the simulation it slides on two points under its belly, a
    tenth of a millimetre above the floor.
    """

    senses = (
        *ENCODERS,
        *(_proximity(number) for number in range(len(PROXIMITY))),
        Gyro("gyro/z", (0.0, 0.0, 1.0)),
        Accelerometer("acceleration/x", (1.0, 0.0, 0.0)),
        Accelerometer("acceleration/y", (0.0, 1.0, 0.0)),
        Accelerometer("acceleration/z", (0.0, 0.0, 1.0)),
    )
    counted = COUNTED
    wheel_width, wheel_mass = 0.005, 0.005  # Webots
    gears, droop = 5e-5, 0.03  # guesses: with less, MuJoCo's wheels slip

    parameters = figures(
        wheel_radius=(WHEEL, f"{WEBOTS}; GCTronic: about 41 mm across"),
        track=(0.052, f"between the wheels; {WEBOTS}; GCTronic: 53 mm"),
        max_wheel_speed=(6.28, "1000 steps/s of 1000 a turn; GCTronic"),
        mass=(0.16, f"{WEBOTS}, with its wheels"),
        wheel_torque=(0.02, "a guess: the steppers lose no steps"),
        wheel_friction=(0.8, "Coulomb; a guess, rubber on a hard floor"),
    )
    sensors = Out(sensed("epuck.sensors", senses, WEBOTS))

    def chassis(self, mass: float) -> tuple[Part, ...]:
        """Return the belly between the wheels, the plate over them, and a battery."""
        light = 0.001
        rest = mass - 2 * light
        high = 0.041  # of the plate above the floor: over the wheels
        low = Cylinder(0.022, high - 0.003)
        # Heavy below: the centre of mass is 15 mm above the floor, as in Webots.
        shares = (
            Part(Box((0.04, 0.03, 0.008)), 0.58 * rest, (0.0, 0.0, -0.0155), None),
            Part(low, 0.3 * rest, (0.0, 0.0, 0.002), friction=0.3),
            Part(Cylinder(0.0355, 0.009), 0.12 * rest, (0.0, 0.0, 0.0255), 0.3),
        )
        feet = [
            Part(Sphere(0.002), light, (x, 0.0, 0.0021 - WHEEL), friction=0.01)
            for x in (0.025, -0.025)
        ]
        return *shares, *feet

    def noise(self) -> dict[str, Noise]:
        """Return the noise of the sensors.

        As in Webots' E-puck, whose proximity sensors have noise in their counts: the
        slope of their table converts it to metres. The wheels have 1000 steps a turn.
        The gyro's noise is not known.
        """
        return {
            "encoder/*": Noise(step=2 * pi / 1000),
            "proximity/*": Noise(table=tuple(_spreads())),
            "acceleration/*": Noise(relative=0.003),
        }

    def webots(self) -> Devices:
        """Return the devices' names in Webots' E-puck; version 1 has no gyro."""
        return Devices(
            motors=two_sides(["left wheel motor"], ["right wheel motor"]),
            readings=(
                *encoders("left wheel sensor", "right wheel sensor"),
                *(
                    Reading(f"proximity/{number}", f"ps{number}", table=COUNTS)
                    for number in range(len(PROXIMITY))
                ),
                Reading("gyro/z", "gyro", part=2, factor=13.316 / 100_000),
                *(
                    Reading(f"acceleration/{axis}", "accelerometer", part=part)
                    for part, axis in enumerate("xyz")
                ),
            ),
        )


class EpuckWithCamera(Epuck):
    """An e-puck with a camera ahead, of 52 by 39 pixels, as in Webots."""

    senses = (
        *Epuck.senses,
        Camera("camera", (0.03, 0.0, 0.028 - WHEEL), (1.0, 0.0, 0.0), 52, 39, 0.84),
    )
    sensors = Out(sensed("epuck_camera.sensors", senses, WEBOTS))

"""Pioneer3DX and Pioneer3AT: MobileRobots' platforms of two and of four wheels."""

from math import radians

from rems_net.agents.ports import Out
from rems_net.agents.robot import Definition
from rems_net.bodies.body import Box, Cylinder, Part, Ray, Sphere
from rems_net.bodies.devices import Devices, Reading, encoders, two_sides
from rems_net.bodies.noise import Noise
from rems_net.maths import cos, sin
from rems_net.robots.differential import ENCODERS, Differential, figures
from rems_net.robots.sensing import sensed
from rems_net.robots.skid_steered import SkidSteered

#: m. Range of the sonars: Webots' look-up table; ARIA's own limit is 4.335.
REACH = 5.0
ARIA = "p3dx.p of ARIA"
#: the sonars' names in Webots, and their counts: 1024 at no distance, 0 at their range
SONARS = tuple(
    Reading(f"sonar/{number}", f"so{number}", factor=-REACH / 1024, offset=REACH)
    for number in range(16)
)
#: degrees from ahead. Directions of the first eight sonars, and of the rear eight.
FAN = (90, 50, 30, 10, -10, -30, -50, -90)
BACK = (-90, -130, -150, -170, 170, 150, 130, 90)


def _sonars(places: tuple[tuple[int, int], ...], height: float) -> tuple[Ray, ...]:
    """Return the rays of 16 sonars at these x and y, mm, and this z, m."""
    ways = [
        (float(cos(radians(d))), float(sin(radians(d))), 0.0) for d in (*FAN, *BACK)
    ]
    return tuple(
        Ray(f"sonar/{number}", (x / 1000, y / 1000, height), way, REACH)
        for number, ((x, y), way) in enumerate(zip(places, ways, strict=True))
    )


def _devices(left: list[str], right: list[str]) -> Devices:
    """Return the devices in Webots; left, right: the names of the wheels' motors."""
    turned = encoders(f"{left[0]} sensor", f"{right[0]} sensor")
    return Devices(motors=two_sides(left, right), readings=(*turned, *SONARS))


def _noise(self: Definition) -> dict[str, Noise]:
    """Return the noise of the sensors.

    As in Webots: the sonars have 1 % noise of their counts, which are 1024 for
    something that touches and 0 at 5 m. The encoders' noise is not known.
    """
    return {"sonar/*": Noise(table=((0.0, 0.01 * REACH), (REACH, 0.0)))}


class Pioneer3DX(Differential):
    """The Pioneer 3-DX: two wheels, a caster behind, and two rings of eight sonars.

    The sonars are single rays here, not cones. The body is made of the boxes and
    cylinders with which Webots' robot collides; the place of its caster is a guess.
    """

    senses = (
        *ENCODERS,
        *_sonars(
            (
                *((69, 136), (114, 119), (148, 78), (166, 27)),
                *((166, -27), (148, -78), (114, -119), (69, -136)),
                *((-157, -136), (-203, -119), (-237, -78), (-255, -27)),
                *((-255, 27), (-237, 78), (-203, 119), (-157, 136)),
            ),
            height=0.114,
        ),
    )
    wheel_width, wheel_mass, gears = 0.048, 0.5, 0.02  # Webots; guesses the last two

    parameters = figures(
        wheel_radius=(0.0975, "Webots' Pioneer3dx"),
        track=(0.33, "between the wheels; Webots' Pioneer3dx"),
        max_wheel_speed=(12.3, "1.2 m/s; Webots' Pioneer3dx"),
        mass=(9.0, "Webots' guide"),
        centre_of_mass=(-0.06, "ahead of the axle; Webots' Pioneer3dx"),
        wheel_torque=(5.0, "a guess"),
        wheel_friction=(0.8, "Coulomb; a guess, rubber on a hard floor"),
    )
    sensors = Out(sensed("pioneer3dx.sensors", senses, ARIA))

    def chassis(self, mass: float) -> tuple[Part, ...]:
        """Return hull, sonar rings, deck and caster, and the batteries in the hull.

        The batteries are placed so that the robot has the centre of mass of the
        parameters.
        """
        p = self.parameters
        ball = 0.0375
        shells = (
            Part(Box((0.341, 0.2, 0.115)), 1.0, (-0.04, 0.0, 0.0285), 0.3),
            Part(Cylinder(0.15, 0.05), 0.4, (0.023, 0.0, 0.112), 0.3),
            Part(Cylinder(0.15, 0.05), 0.4, (-0.114, 0.0, 0.112), 0.3),
            Part(Cylinder(0.19, 0.007), 0.4, (-0.05, 0.0, 0.142), 0.3),
            Part(Sphere(ball), 0.2, (-0.2, 0.0, ball - p.wheel_radius), 0.0),
        )
        load = mass - sum(part.mass for part in shells)
        moment = p.mass * p.centre_of_mass
        moment -= sum(part.mass * part.at[0] for part in shells)
        at = (moment / load, 0.0, 0.0285)
        return *shells, Part(Box((0.2, 0.2, 0.1)), load, at, friction=None)

    noise = _noise

    def webots(self) -> Devices:
        """Return the devices' names in Webots' Pioneer3dx."""
        return _devices(["left wheel"], ["right wheel"])


class Pioneer3AT(SkidSteered):
    """The Pioneer 3-AT: four wheels, the rear ones slaves of the front ones.

    ARIA computes its turning from the wheels' speeds with DiffConvFactor 0.0034, an
    effective track of 2 mm / 0.0034. By friction alone it would be 0.574 m.
    """

    axles = ((0.1331, 0.0), (-0.1331, 0.0))  # Webots
    senses = (
        *ENCODERS,
        *_sonars(
            (
                *((147, 136), (193, 119), (227, 79), (245, 27)),
                *((245, -27), (227, -79), (193, -119), (147, -136)),
                *((-144, -136), (-189, -119), (-223, -79), (-241, -27)),
                *((-241, 27), (-223, 79), (-189, 119), (-144, 136)),
            ),
            height=0.13,  # a guess
        ),
    )
    wheel_width, wheel_mass, gears = 0.096, 0.8, 0.2  # Webots' mesh; guesses

    parameters = figures(
        wheel_radius=(0.11, "Webots' Pioneer3at"),
        track=(0.394, "between the wheels; Webots' Pioneer3at"),
        effective_track=(0.588, "2 mm / DiffConvFactor 0.0034; p3at.p of ARIA"),
        max_wheel_speed=(6.4, "0.7 m/s; Webots' Pioneer3at"),
        mass=(12.0, "Webots' guide"),
        wheel_torque=(20.0, "Webots' Pioneer3at"),
        wheel_friction=(0.8, "Coulomb; a guess, rubber on a hard floor"),
    )
    sensors = Out(sensed("pioneer3at.sensors", senses, "p3at.p of ARIA"))

    def chassis(self, mass: float) -> tuple[Part, ...]:
        """Return the hull, from Webots' mesh, and a deck as long as the robot."""
        hull = Part(Box((0.403, 0.266, 0.190)), 0.9 * mass, (0.0, 0.0, 0.058), 0.3)
        deck = Part(Box((0.508, 0.381, 0.010)), 0.1 * mass, (0.0, 0.0, 0.158), 0.3)
        return hull, deck

    noise = _noise

    def webots(self) -> Devices:
        """Return the devices' names in Webots' Pioneer3at."""
        return _devices(
            ["front left wheel", "back left wheel"],
            ["front right wheel", "back right wheel"],
        )

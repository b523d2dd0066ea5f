"""Create2: iRobot's round robot for schools, a Roomba 600 without its vacuum."""

from math import pi, radians

from rems_net.agents.ports import Out
from rems_net.bodies.body import Cylinder, Part, Sphere, Switch, Vector
from rems_net.bodies.devices import Devices, Reading, encoders, two_sides
from rems_net.bodies.noise import Noise
from rems_net.maths import cos, sin
from rems_net.robots.differential import ENCODERS, Differential, figures
from rems_net.robots.sensing import sensed

OI = "Open Interface 2016"
#: m: 0.34 across and 0.092 high (the Roomba's); the height above the floor is a guess
RADIUS, HEIGHT, CLEARANCE = 0.17, 0.092, 0.015
WHEEL = 0.036
#: m. Radius and places of the casters: Webots' Create; the rear one prevents tipping.
CASTER, FRONT, REAR = 0.010, 0.129, -0.1315
#: m. Centre of mass ahead of the axle: a guess, so that the front caster carries load.
AHEAD = 0.02

Whisker = tuple[Vector, Vector]


def _whiskers(*degrees: float) -> tuple[Whisker, ...]:
    """Return the bumper's edge and the way out, at these angles from ahead."""
    ways = [(float(cos(radians(d))), float(sin(radians(d)))) for d in degrees]
    return tuple(((RADIUS * c, RADIUS * s, 0.01), (c, s, 0.0)) for c, s in ways)


def _cliff(name: str, x: float, y: float) -> Switch:
    down = (((x, y, CLEARANCE - WHEEL), (0.0, 0.0, -1.0)),)
    return Switch(f"cliff/{name}", down, reach=0.05, empty=True)


class Create2(Differential):
    """The iRobot Create 2: a round robot with two wheels and a caster in front.

    The places of bumper and cliff sensors are from Webots' Create. Guesses: a bumper
    gives way by 5 mm, and a cliff is a floor more than 50 mm below.
    """

    senses = (
        *ENCODERS,
        Switch("bumper/left", _whiskers(10, 30, 50, 70), reach=0.005),
        Switch("bumper/right", _whiskers(-10, -30, -50, -70), reach=0.005),
        _cliff("left", 0.07, 0.15),
        _cliff("front_left", 0.15, 0.04),
        _cliff("front_right", 0.15, -0.04),
        _cliff("right", 0.07, -0.15),
    )
    wheel_width, wheel_mass, gears = 0.020, 0.05, 2e-3  # guesses

    parameters = figures(
        wheel_radius=(WHEEL, f"72 mm across; {OI}"),
        track=(0.235, f"between the wheels; {OI}"),
        max_wheel_speed=(0.5 / WHEEL, f"500 mm/s; {OI}, command 145"),
        mass=(3.58, "a guess, of a Roomba 600 with its battery"),
        wheel_torque=(0.5, "a guess"),
        wheel_friction=(0.8, "Coulomb; a guess, rubber on a hard floor"),
    )
    sensors = Out(sensed("create2.sensors", senses, OI))

    def chassis(self, mass: float) -> tuple[Part, ...]:
        """Return the shell, with a load that puts the weight ahead, and the casters."""
        height, light = HEIGHT - CLEARANCE, 0.01
        half = (mass - 2 * light) / 2
        middle = (0.0, 0.0, CLEARANCE + height / 2 - WHEEL)
        shell = Part(Cylinder(RADIUS, height), half, middle, friction=0.3)
        load = Part(Cylinder(0.08, 0.04), half, (2 * AHEAD, 0.0, 0.0), friction=None)
        low = CASTER - WHEEL
        front = Part(Sphere(CASTER), light, (FRONT, 0.0, low), friction=0.0)
        rear = Part(Sphere(CASTER), light, (REAR, 0.0, low + 0.001), friction=0.0)
        return shell, load, front, rear

    def noise(self) -> dict[str, Noise]:
        """Return the noise of the sensors.

        The encoders count 508.8 steps a turn (Open Interface). The noise of bumpers
        and cliff sensors is not known.
        """
        return {"encoder/*": Noise(step=2 * pi / 508.8)}

    def webots(self) -> Devices:
        """Return the devices' names in Webots' Create, which is a Create 1."""
        cliffs = ("left", "front_left", "front_right", "right")
        return Devices(
            motors=two_sides(["left wheel motor"], ["right wheel motor"]),
            readings=(
                *encoders("left wheel sensor", "right wheel sensor"),
                Reading("bumper/left", "bumper_left"),
                Reading("bumper/right", "bumper_right"),
                # Below 100 there is no floor, as in Webots' own controller.
                *(
                    Reading(f"cliff/{c}", f"cliff_{c}", factor=-1.0, offset=100.5)
                    for c in cliffs
                ),
            ),
        )

"""The effective track of wheels that skid, by friction alone."""

from collections.abc import Iterable
from math import hypot

from rems_net.robots.skid_steered import SkidSteered


def touching(robot: SkidSteered) -> list[tuple[float, float]]:
    """Return the contacts of the left side with an even floor, x and y, m."""
    return [(x, robot.parameters.track / 2) for x, z in robot.axles if z == 0]


def skidding(places: Iterable[tuple[float, float]]) -> float:
    """Return the effective track, m, of wheels that skid on a hard, even floor.

    places: x and y of the left side's contacts with the floor, m; the right side is its
    mirror image. Each contact has the same load and the same friction, which acts
    against the direction of its slip (Coulomb), and nothing accelerates. Then the
    moments of all these forces about the middle add up to 0:

        sum of (x**2 + y**2 - v y) / hypot(v - y, x) = 0

    where v is the speed of the left side's wheels, for a robot that turns by 1 rad/s;
    the effective track is 2 v. With two axles a wheelbase L apart and thin
    tyres it is W + L**2 / W, so it does not depend on how slippery the floor is.
    """
    known = list(places)

    def moment(v: float) -> float:
        return sum((x * x + y * y - v * y) / hypot(v - y, x) for x, y in known)

    low = min(y for _, y in known)
    high = max((x * x + y * y) / y for x, y in known)
    for _ in range(60):  # each halves the interval: to the last bit
        middle = (low + high) / 2
        if moment(middle) > 0:
            low = middle
        else:
            high = middle
    return low + high

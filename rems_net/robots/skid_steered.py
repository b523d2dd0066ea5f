"""SkidSteered: robots on several axles, whose wheels skid sideways in a turn."""

from collections.abc import Iterable
from typing import Any, ClassVar

from rems_net.bodies.body import Hinge
from rems_net.defdict import DefDict
from rems_net.kinematics.wheels import Wheels
from rems_net.maths import hypot
from rems_net.robots.differential import Differential


class SkidSteered(Differential):
    """A robot with several wheels on each side, which turn together.

    The command names the wheels of the first axle; those of the others are their slaves
    (`Hinge.command`). In a turn all wheels skid, and the robot turns as if it rolled on
    two wheels `effective_track` apart, which is more than `track`. That is exact for
    slow motion, at any speed ahead, if friction is Coulomb's and the load is spread
    evenly; see `skidding`.
    """

    #: m. Places of the axles, ahead of the origin and above it, from front to back. An
    #: axle above it carries no weight on an even floor.
    axles: ClassVar[tuple[tuple[float, float], ...]]

    def turning(self, command: DefDict) -> Any:
        """Return the rate of the heading, rad/s."""
        p = self.parameters
        faster = command["wheel/right"] - command["wheel/left"]
        return p.wheel_radius * faster / p.effective_track

    def mechanisms(self) -> dict[str, Wheels]:
        """Return the kinematics of two wheels, `effective_track` apart."""
        return self.rolling(self.parameters.effective_track)

    def wheels(self) -> tuple[Hinge, ...]:
        """Return the wheels, axle by axle."""
        return tuple(
            wheel
            for number, (x, z) in enumerate(self.axles)
            for wheel in self.pair(x, z, str(number + 1) if number else "")
        )

    def touching(self) -> list[tuple[float, float]]:
        """Return the contacts of the left side with an even floor, x and y, m."""
        return [(x, self.parameters.track / 2) for x, z in self.axles if z == 0]


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
        return sum((x * x + y * y - v * y) / float(hypot(v - y, x)) for x, y in known)

    low = min(y for _, y in known)
    high = max((x * x + y * y) / y for x, y in known)
    for _ in range(60):  # each halves the interval: to the last bit
        middle = (low + high) / 2
        if moment(middle) > 0:
            low = middle
        else:
            high = middle
    return low + high

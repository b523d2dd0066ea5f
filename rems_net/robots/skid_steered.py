"""SkidSteered: robots on several axles, whose wheels skid sideways where they turn."""

from collections.abc import Iterable
from typing import Any, ClassVar

from rems_net.bodies.body import Hinge
from rems_net.defdict import DefDict
from rems_net.kinematics.mechanism import Mechanism
from rems_net.maths import hypot
from rems_net.robots.differential import Differential


class SkidSteered(Differential):
    """A robot with several wheels on each side, which turn as one.

    The wheels of the first axle are the ones the command names; those of the others
    are their slaves (`Hinge.command`). In a turn all of them skid, and the robot
    turns as one would that rolls on two wheels `effective_track` apart, which is more
    than `track`. That is exact for slow motion, whatever the speed ahead, as long as
    friction is Coulomb's and the load is spread evenly; see `skidding`.
    """

    #: where the axles are, m ahead of the origin and above it, from front to back; one
    #: that is above it bears no weight on an even floor
    axles: ClassVar[tuple[tuple[float, float], ...]]

    def turning(self, command: DefDict) -> Any:
        """Return the rate of the heading, rad/s."""
        p = self.parameters
        faster = command["wheel/right"] - command["wheel/left"]
        return p.wheel_radius * faster / p.effective_track

    def mechanisms(self) -> dict[str, Mechanism]:
        """Return the kinematics of its wheels, as far apart as they turn it."""
        return self.rolling(self.parameters.effective_track)

    def wheels(self) -> tuple[Hinge, ...]:
        """Return its wheels, axle by axle."""
        return tuple(
            wheel
            for number, (x, z) in enumerate(self.axles)
            for wheel in self.pair(x, z, str(number + 1) if number else "")
        )

    def touching(self) -> list[tuple[float, float]]:
        """Return where the treads of the left side touch an even floor, x and y, m."""
        return [(x, self.parameters.track / 2) for x, z in self.axles if z == 0]


def skidding(places: Iterable[tuple[float, float]]) -> float:
    """Return the effective track, m, of wheels that skid on a hard, even floor.

    places: x and y of where the left side touches the floor, m; the right side is its
    mirror image. Each touches with the same load and the same friction, which acts
    against the direction in which it slips (Coulomb), and nothing accelerates. Then
    the moments of all these forces about the middle add up to nothing:

        sum of (x**2 + y**2 - v y) / hypot(v - y, x) = 0

    where v is the speed of the left side's wheels, taken for a robot that turns by
    1 rad/s; the effective track is 2 v. With two axles a wheelbase L apart and thin
    tyres it is W + L**2 / W, so it does not depend on how slippery the floor is.
    """
    known = list(places)

    def moment(v: float) -> float:
        return sum((x * x + y * y - v * y) / float(hypot(v - y, x)) for x, y in known)

    low = min(y for _, y in known)
    high = max((x * x + y * y) / y for x, y in known)
    for _ in range(60):  # each halves what is left: to the last bit
        middle = (low + high) / 2
        if moment(middle) > 0:
            low = middle
        else:
            high = middle
    return low + high

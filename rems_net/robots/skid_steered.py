"""SkidSteered: robots on several axles, whose wheels skid sideways in a turn."""

from typing import ClassVar

from rems_net.bodies.body import Hinge
from rems_net.robots.differential import Differential


class SkidSteered(Differential):
    """A robot with several wheels on each side, which turn together.

    The command names the wheels of the first axle; those of the others are their slaves
    (`Hinge.command`). In a turn all wheels skid, and the robot turns as if it rolled on
    two wheels `effective_track` apart, which is more than `track`. That is exact for
    slow motion, at any speed ahead, if friction is Coulomb's and the load is spread
    evenly: then the moments of friction about the middle add up to 0.
    """

    #: m. Places of the axles, ahead of the origin and above it, from front to back. An
    #: axle above it carries no weight on an even floor.
    axles: ClassVar[tuple[tuple[float, float], ...]]

    turning_track = "effective_track"

    def wheels(self) -> tuple[Hinge, ...]:
        """Return the wheels, axle by axle."""
        return tuple(
            wheel
            for number, (x, z) in enumerate(self.axles)
            for wheel in self.pair(x, z, str(number + 1) if number else "")
        )

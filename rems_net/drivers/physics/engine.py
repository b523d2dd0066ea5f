"""Engine: what each physics engine is asked, and nothing more is.

An engine's world has a floor, walls, things, and any number of bodies, each of which
is one `Instance` there. Positions in m in the world's frame.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rems_net.bodies.parts import Array
from rems_net.bodies.sensors import Camera

#: What a camera sees: (height, width, 3), red, green and blue.
Picture = NDArray[np.uint8]

#: Bodies are built this far apart, and then put where they start, m.
APART = 100.0
#: How much of its radius a ball's weight acts ahead of its middle: it comes to a stop.
ROLLING = 0.01


class Instance(Protocol):
    """One robot's body in an engine's world."""

    def joints(self) -> tuple[Sequence[float], Sequence[float]]:
        """Return where each joint of the body's `Tree` is, and how fast it goes."""

    def bend(self, positions: Sequence[float]) -> None:
        """Put every joint of the body's `Tree` there, at rest."""

    def velocity(self) -> Array:
        """Return the velocity (3,) of the body's origin, m/s, in the world's frame."""

    def move(self, shift: Sequence[float], yaw: float) -> None:
        """Put the body elsewhere, turned by `yaw` about its own origin, at rest.

        What follows from it is brought up to date by `Engine.refresh`.
        """

    def picture(self, camera: Camera, eye: Array, ahead: Array, up: Array) -> Picture:
        """Return what is seen by one of its body's cameras, which is at `eye`.

        ahead, up: unit vectors to what it looks at, and to the top of the picture
        """

    def restore(self) -> None:
        """Put this body, and no other, back to what was kept."""


class Engine(Protocol):
    """One world in some engine."""

    @property
    def instances(self) -> Sequence[Instance]:
        """Its bodies, in their order."""

    def command(self, targets: Sequence[Sequence[float]]) -> None:
        """Tell the motors of each body, in the order of its joints, until told anew."""

    def advance(self, h: float, count: int) -> None:
        """Take `count` steps of `h` s."""

    def poses(self) -> tuple[Array, Array]:
        """Return positions (n, 3) and rotations (n, 3, 3), body to world, of bodies."""

    def spins(self, rotations: Array) -> Array:
        """Return angular velocities (n, 3) of bodies, rad/s, in the world's frame.

        rotations: theirs, as `poses` has told them
        """

    def rays(
        self,
        bodies: Sequence[int],
        starts: Array,
        ways: Array,
        reaches: Sequence[float],
    ) -> list[float]:
        """Return how far it is along each ray to the nearest thing, at most its reach.

        bodies: whose ray each is: that body is not seen.  starts, ways: (k, 3)
        """

    def refresh(self) -> None:
        """Bring up to date what follows from bodies that were moved."""

    def keep(self) -> None:
        """Remember everything as it is now, to the last bit."""

    def restore(self) -> None:
        """Put everything back to what was kept, without building anything."""

    def thing(self, number: int) -> tuple[Array, Array]:
        """Return the pose of one of the scene's things, in their order."""

    def close(self) -> None:
        """Give everything back."""

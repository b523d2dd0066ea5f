"""Engine: the functions that every physics engine must offer.

An engine's world has a floor, walls, things, and any number of bodies, each as one
`Instance`. Positions are in m in the world's frame.
"""

from collections.abc import Sequence
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rems_net.bodies.parts import Array
from rems_net.bodies.sensors import Camera
from rems_net.scenes.ghost import Ghost

#: a ray: its start and its direction (3,), in the world's frame
Line: TypeAlias = tuple[Array, Array]
#: a ray to measure: the number of its body, which it ignores; its line; its reach, m
Aim: TypeAlias = tuple[int, Line, float]
#: picture of a camera: (height, width, 3), red, green and blue
Picture = NDArray[np.uint8]

#: m. Distance between bodies as they are built; then they are put to their poses.
APART = 100.0
#: m. Where a ghost is that is not there.
AWAY = (0.0, 0.0, -1000.0)
#: Rolling friction of a ball, as a share of its radius, so that it comes to a stop.
ROLLING = 0.01


class Instance(Protocol):
    """One robot's body in an engine's world."""

    def joints(self) -> tuple[Sequence[float], Sequence[float]]:
        """Return position and speed of each joint of the body's `Tree`."""

    def bend(self, positions: Sequence[float]) -> None:
        """Put the joints of the body's `Tree` at these positions, at rest."""

    def velocity(self) -> Array:
        """Return the velocity (3,) of the body's origin, m/s, in the world's frame."""

    def move(self, shift: Sequence[float], yaw: float) -> None:
        """Move the body by `shift`, m, turn it by `yaw` about its origin; at rest.

        `Engine.refresh` then updates the values that depend on its pose.
        """

    def picture(self, camera: Camera, eye: Array, ahead: Array, up: Array) -> Picture:
        """Return the picture of one of the body's cameras, which is at `eye`.

        ahead, up: unit vectors along the line of sight, and to the picture's top
        """

    def restore(self) -> None:
        """Put this body, and no other, back to the kept state."""


class Engine(Protocol):
    """One world in some engine."""

    @property
    def instances(self) -> Sequence[Instance]:
        """The world's bodies, in their order."""

    def command(self, targets: Sequence[Sequence[float]]) -> None:
        """Set the motors' targets of each body, in the order of its joints."""

    def advance(self, h: float, count: int) -> None:
        """Take `count` steps of `h` s."""

    def poses(self) -> tuple[Array, Array]:
        """Return positions (n, 3) and rotations (n, 3, 3), body to world, of bodies.

        Each call returns the same arrays, with the present values.
        """

    def spins(self) -> Array:
        """Return angular velocities (n, 3) of bodies, rad/s, in their own frames.

        Each call returns the same array, with the present values. Call `poses` first.
        """

    def aim(self, rays: Sequence[Aim]) -> None:
        """Set the rays that `rays` measures. The arrays of their lines may change."""

    def rays(self) -> list[float]:
        """Return each ray's distance to the nearest thing, m, at most its reach."""

    def refresh(self) -> None:
        """Update the values that depend on the poses of moved bodies."""

    def keep(self) -> None:
        """Store the state of everything, to the last bit."""

    def restore(self) -> None:
        """Put everything back to the stored state, without building anything."""

    def thing(self, number: int) -> tuple[Array, Array]:
        """Return the pose of one of the scene's things, in their order."""

    def haunt(self, number: int, ghost: Ghost) -> None:
        """Put one of the scene's ghosts, in their order, where it is now."""

    def look(self, number: int, start: Array, way: Array, reach: float) -> float:
        """Return a ray's distance to the nearest thing but this ghost, m."""

    def close(self) -> None:
        """Release the engine's memory."""

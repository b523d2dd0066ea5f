"""Scene: a place and the things in it, without robots, for every engine."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rems_net.bodies.arena import Wall
from rems_net.bodies.marker import Marker
from rems_net.bodies.parts import Array, Shape, Vector
from rems_net.maths import sincos

if TYPE_CHECKING:
    from rems_net.scenes.ghost import Ghost

#: red, green and blue, 0 to 1
Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Thing:
    """A solid with a name, in a scene.

    at: its middle, m heading,
    pitch: about z, then up about its own y, rad
    mass: kg; at 0 it never moves
    friction: Coulomb's coefficient
    colour: in cameras' pictures
    """

    name: str
    shape: Shape
    at: Vector
    heading: float = 0.0
    pitch: float = 0.0
    mass: float = 0.0
    friction: float = 0.5
    colour: Colour = (0.6, 0.6, 0.6)

    def rotation(self) -> Array:
        """Return the rotation (3, 3), thing to world."""
        s, c = sincos(self.heading)
        u, d = sincos(self.pitch)
        # Pitch lifts x, so it is a negative angle about y by the right-hand rule.
        return np.array([[c * d, -s, -c * u], [s * d, c, -s * u], [u, 0.0, d]])


@dataclass(frozen=True, slots=True)
class Scene:
    """A flat floor at z = 0, walls that never move, and things.

    radius: of the round wall among them, m; 0 if there is none
    mjcf: path of a MuJoCo model that is the place; "" for none
    bodies: names of that model's bodies with a pose to read, after the things
    ghosts: bodies that follow a pose
    markers: number of a thing and its marker, in the thing's frame; -1 for the floor
    """

    walls: tuple[Wall, ...] = ()
    things: tuple[Thing, ...] = ()
    radius: float = 0.0
    mjcf: str = ""
    bodies: tuple[str, ...] = ()
    ghosts: "tuple[Ghost, ...]" = ()
    markers: tuple[tuple[int, Marker], ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of things and bodies with a pose to read, in order of their numbers."""
        return (*(thing.name for thing in self.things), *self.bodies)

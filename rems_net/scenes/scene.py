"""Scene: a place and what is in it besides robots, in the words of every engine."""

from dataclasses import dataclass

import numpy as np

from rems_net.bodies.arena import Wall
from rems_net.bodies.parts import Array, Shape, Vector
from rems_net.maths import sincos

#: red, green and blue, 0 to 1
Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Thing:
    """A solid that is there and has a name.

    at: its middle, m      heading, pitch: about z, then up about its own y, rad
    mass: kg; at 0 it stays where it is, whatever pushes it
    friction: Coulomb's coefficient
    colour: as cameras see it
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
        # x goes up with the pitch, so it is minus the pitch about y by the right hand.
        return np.array([[c * d, -s, -c * u], [s * d, c, -s * u], [u, 0.0, d]])


@dataclass(frozen=True, slots=True)
class Scene:
    """A flat floor at z = 0, walls that nothing moves, and things.

    radius: of the round wall among them, m; 0 where there is none
    mjcf: path of a MuJoCo model that is the place; "" for none
    bodies: names of those of its bodies that are asked for, after the things
    """

    walls: tuple[Wall, ...] = ()
    things: tuple[Thing, ...] = ()
    radius: float = 0.0
    mjcf: str = ""
    bodies: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Of all that can be asked where it is, in the order of their numbers."""
        return (*(thing.name for thing in self.things), *self.bodies)

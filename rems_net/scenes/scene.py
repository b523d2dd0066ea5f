"""Scene: a place and the things in it, without robots, for every engine.

Walls, things and robots are also solids: shapes at their places.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rems_net.bodies.arena import Wall
from rems_net.bodies.body import Body
from rems_net.bodies.marker import Marker
from rems_net.bodies.parts import Array, Box, Shape, Vector
from rems_net.bodies.tree import Tree
from rems_net.maths import sincos

if TYPE_CHECKING:
    from rems_net.scenes.ghost import Ghost

#: red, green and blue, 0 to 1
Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Solid:
    """A shape at its place: its middle (3,) in m, its rotation (3, 3)."""

    shape: Shape
    at: Array
    turn: Array

    def moved(self, at: Array, turn: Array) -> "Solid":
        """Return the solid in the world, if its frame has this pose."""
        return Solid(self.shape, at + turn @ self.at, turn @ self.turn)


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

    @property
    def solid(self) -> Solid:
        """Its shape, at its place."""
        s, c = sincos(self.heading)
        u, d = sincos(self.pitch)
        # Pitch lifts x, so it is a negative angle about y by the right-hand rule.
        turn = np.array([[c * d, -s, -c * u], [s * d, c, -s * u], [u, 0.0, d]])
        return Solid(self.shape, np.array(self.at), turn)


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

    @property
    def solids(self) -> list[Solid]:
        """The walls and the things."""
        return [*map(solid_of, self.walls), *(thing.solid for thing in self.things)]


def solid_of(wall: Wall) -> Solid:
    """Return a wall as a solid."""
    return Solid(Box(wall.size), np.array(wall.at), upright(wall.yaw))


def solids_of(body: Body) -> list[Solid]:
    """Return a robot's shapes that can touch, in its own frame, joints at zero."""
    tree = Tree(body)
    places, turns = tree.places([0.0] * len(tree.links))
    links = zip(tree.links, places, turns, strict=True)
    each = [(body.parts, np.zeros(3), np.eye(3))]
    each += [(link.joint.parts, at, turn) for link, at, turn in links]
    return [
        Solid(part.shape, at + turn @ np.array(part.at), turn)
        for parts, at, turn in each
        for part in parts
        if part.friction is not None
    ]


def upright(heading: float) -> Array:
    """Return the rotation (3, 3) about z."""
    s, c = sincos(heading)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

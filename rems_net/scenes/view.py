"""View: a place and what is in it as plain values, for programs that draw them.

Lengths are in m, angles in rad. An outline is a list of corners (x, y), seen from
above. A solid is a box, a cylinder or a ball, with its pose in the frame of its owner.
"""

from typing import Any

from rems_net.bodies.arena import WALL_PIECES, Arena
from rems_net.bodies.body import Body
from rems_net.bodies.parts import Box, Cylinder, Shape, Sphere
from rems_net.bodies.sensors import Ray
from rems_net.scenes import outline, rays
from rems_net.scenes.scene import Scene

#: digits behind the point: a tenth of a millimetre
DIGITS = 4


def of_scene(scene: Scene) -> dict[str, Any]:
    """Return a scene: radius of its round wall, other walls, and things.

    An outline of a thing is in its own frame, since things move.
    """
    walls = scene.walls[WALL_PIECES if scene.radius else 0 :]
    return {
        "radius": scene.radius,
        "walls": [
            {"outline": _corners(outline.of_wall(wall)), "height": wall.size[2]}
            for wall in walls
        ],
        "things": [
            {
                "name": thing.name,
                "outline": _corners(
                    outline.of_thing(thing).at((-thing.at[0], -thing.at[1], 0.0)),
                    thing.heading,
                ),
                "solid": _solid(thing.shape),
                "at": _numbers(thing.at),
                "heading": thing.heading,
                "pitch": thing.pitch,
                "colour": list(thing.colour),
            }
            for thing in scene.things
        ],
    }


def of_arena(arena: Arena) -> dict[str, Any]:
    """Return the place of a robot that is alone."""
    return {"radius": arena.radius}


def of_body(body: Body) -> dict[str, Any]:
    """Return a robot's outline, its solids with all joints at zero, and its rays."""
    return {
        "outline": _corners(outline.of_body(body)),
        "height": body.height,
        "solids": [
            {
                **_solid(one.shape),
                "at": _numbers(one.at),
                "turn": [_numbers(row) for row in one.turn],
            }
            for one in rays.of_body(body)
        ],
        "rays": [
            {
                "name": one.name,
                "at": _numbers(one.at),
                "direction": _numbers(one.direction),
                "reach": one.reach,
            }
            for one in body.sensors
            if isinstance(one, Ray)
        ],
    }


def _corners(one: outline.Outline, heading: float = 0.0) -> list[list[float]]:
    turned = one.at((0.0, 0.0, -heading))
    return [_numbers(corner) for corner in turned.corners]


def _solid(shape: Shape) -> dict[str, Any]:
    match shape:
        case Box(size):
            return {"box": _numbers(size)}
        case Cylinder(radius, length, axis):
            return {"cylinder": _numbers((radius, length)), "axis": _numbers(axis)}
        case Sphere(radius):
            return {"ball": round(radius, DIGITS)}


def _numbers(some: Any) -> list[float]:
    return [round(float(one), DIGITS) for one in some]

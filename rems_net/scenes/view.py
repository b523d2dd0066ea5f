"""View: a place and what is in it as plain values, for programs that draw them.

Lengths are in m, angles in rad. An outline is a list of corners (x, y), seen from
above. A solid is a box (its edges), a cylinder along z (radius and length), a ball
(three radii) or a mesh (its number among `meshes`, and half a box about its origin).
Its middle is `at` and its rotation `turn`, in the frame of its owner: a link, a thing,
or the place. `flat` is false if a view from above hides too much.
"""

from contextlib import suppress
from typing import Any

import numpy as np

from rems_net.bodies.arena import WALL_PIECES
from rems_net.bodies.body import Body
from rems_net.bodies.joints import Slide
from rems_net.bodies.parts import Array, Box, Cylinder, Shape, Sphere
from rems_net.bodies.sensors import Ray
from rems_net.bodies.tree import Tree
from rems_net.scenes import outline
from rems_net.scenes.scene import Scene, solid_of

#: digits behind the point: a tenth of a millimetre
DIGITS = 4
#: colour of ghosts: red, green and blue, 0 to 1
GHOST = [0.5, 0.5, 0.75]


def of_scene(scene: Scene) -> dict[str, Any]:
    """Return a scene: radius of its round wall, other walls, and things.

    An outline of a thing is in its own frame, since things move.
    """
    walls = scene.walls[WALL_PIECES if scene.radius else 0 :]
    return {
        "radius": scene.radius,
        "height": scene.walls[0].size[2] if scene.walls else 0.0,
        "flat": not any(thing.pitch for thing in scene.things),
        "walls": [
            {
                "outline": _corners(outline.of_solid(wall)),
                "solids": [_solid(wall.shape, wall.at, wall.turn)],
            }
            for wall in map(solid_of, walls)
        ],
        "things": [
            {
                "name": thing.name,
                "outline": _corners(
                    outline.of_solid(thing.solid).at((-thing.at[0], -thing.at[1], 0.0)),
                    thing.heading,
                ),
                "solids": [_solid(thing.shape)],
                "at": _numbers(thing.at),
                "heading": thing.heading,
                "pitch": thing.pitch,
                "colour": list(thing.colour),
            }
            for thing in scene.things
        ]
        + ghosts(scene),
    }


def ghosts(scene: Scene) -> list[dict[str, Any]]:
    """Return the ghosts of a scene, as things that are drawn translucent."""
    return [
        {
            "name": ghost.name,
            "ghost": True,
            "outline": _corners(ghost.outline),
            "solids": [_solid(s.shape, s.at, s.turn) for s in ghost.solids],
            "at": _numbers((0.0, 0.0, ghost.body.height)),
            "heading": 0.0,
            "pitch": 0.0,
            "colour": GHOST,
        }
        for ghost in scene.ghosts
    ]


def of_body(body: Body) -> dict[str, Any]:
    """Return a robot's outline, its links with their solids, and its rays.

    A link has the number of its parent, -1 for the robot itself, a place on it, an
    axis, and the state's field for its joint, times `ratio`. While all joints are at
    zero, all frames are parallel. A loop is: link, point on it, other link, point.
    """
    tree = Tree(body)
    joints = [link.stated for link in tree.links]  # wheels with their own axles
    solids = [
        {**_solid(part.shape, np.array(part.at)), "link": number}
        for number, parts in enumerate([body.parts, *(j.parts for j in joints)], -1)
        for part in parts
        if part.friction is not None
    ]
    drawn: dict[str, Any] = {"solids": solids}
    if body.source is not None:
        from rems_net.scenes.model import of_file

        with suppress(Exception):  # the user's file; or MuJoCo is not installed here
            drawn = of_file(body)
    return {
        "outline": _corners(outline.of_body(body)),
        "height": body.height,
        "flat": not any(j.servo or (j.effort and j.joints) for j in joints),
        **drawn,
        "links": [
            {
                "parent": link.parent,
                "at": _numbers(joint.at),
                "axis": _numbers(joint.axis),
                "slides": isinstance(joint, Slide),
                "field": joint.position,
                "ratio": joint.ratio,
            }
            for joint, link in zip(joints, tree.links, strict=True)
        ],
        "loops": [
            [one, _numbers(at), other, _numbers(there)]
            for one, at, other, there in tree.loops
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


def _solid(
    shape: Shape, at: Array | None = None, turn: Array | None = None
) -> dict[str, Any]:
    """Return a solid with its pose; a cylinder is turned so that z is its axis."""
    words: dict[str, Any]
    match shape:
        case Box(size):
            words = {"box": _numbers(size)}
        case Cylinder(radius, length, axis):
            words = {"cylinder": _numbers((radius, length))}
            turn = (np.eye(3) if turn is None else turn) @ _along(np.array(axis))
        case Sphere(radius):
            words = {"ball": _numbers((radius, radius, radius))}
    if at is not None and at.any():
        words["at"] = _numbers(at)
    if turn is not None and (turn != np.eye(3)).any():
        words["turn"] = [_numbers(row) for row in turn]
    return words


def _along(axis: Array) -> Array:
    """Return a rotation (3, 3) that turns z to this unit vector."""
    side = np.array([1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    across = np.cross(axis, side)
    across /= np.sqrt(across @ across)
    return np.column_stack([np.cross(across, axis), across, axis])


def _numbers(some: Any) -> list[float]:
    return [round(float(one), DIGITS) for one in some]

"""Outline: the area of the floor that something covers, and whether two overlap.

An outline is convex, as a rubber band around the thing would be, seen from above.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import pi

import numpy as np

from rems_net.bodies.body import Body
from rems_net.bodies.parts import Array, Box, Cylinder, Shape, Sphere
from rems_net.errors import AgentError, SchemaError
from rems_net.maths import sincos
from rems_net.scenes.scene import Scene, Solid, solid_of, solids_of

#: corners of the polygon that stands for a circle
ROUND = 16
#: m. Outlines that overlap by less than this only touch.
TOUCH = 1e-4

Pose = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Outline:
    """Corners (n, 2) in m, counter-clockwise, and heights from `low` to `high`, m.

    reach: of the furthest corner from the origin, m
    """

    corners: Array
    low: float
    high: float
    reach: float

    def at(self, pose: Pose) -> "Outline":
        """Return the outline moved by x and y in m, and turned by a heading in rad."""
        x, y, heading = pose
        s, c = sincos(heading)
        turned = self.corners @ np.array([[c, s], [-s, c]]) + (x, y)
        return Outline(turned, self.low, self.high, self.reach)

    def meets(self, other: "Outline") -> bool:
        """Return whether the two overlap, on the floor and in height."""
        return self.depth(other) >= TOUCH

    def depth(self, other: "Outline") -> float:
        """Return how far the two overlap, m: the shortest way out; 0 if apart."""
        if self.low >= other.high or other.low >= self.high:
            return 0.0
        return max(
            0.0,
            min(
                _overlap(self.corners, other.corners),
                _overlap(other.corners, self.corners),
            ),
        )


def of_body(body: Body) -> Outline:
    """Return the outline of a robot's parts that can touch anything, joints at zero."""
    points = [corners(one.shape, one.at, one.turn) for one in solids_of(body)]
    return _outline(points, body.height)


def of_solid(solid: Solid) -> Outline:
    """Return the outline of a wall or a thing, at its place in the scene."""
    return _outline([corners(solid.shape, solid.at, solid.turn)], 0.0)


@lru_cache(maxsize=16)  # each reset of a world looks
def of_scene(scene: Scene) -> tuple[tuple[str, Outline], ...]:
    """Return the outlines of a scene, with their names: `a wall` or `'crate'`."""
    walls = [("a wall", of_solid(solid_of(wall))) for wall in scene.walls]
    things = [(repr(one.name), of_solid(one.solid)) for one in scene.things]
    return (*walls, *things)


def met(mine: Outline, others: Iterable[tuple[str, Outline]]) -> str:
    """Return the name of the first outline that overlaps with this one, or ""."""
    if not len(mine.corners):  # it has no shape that touches anything
        return ""
    low, high = mine.corners.min(axis=0), mine.corners.max(axis=0)
    for name, other in others:
        if not len(other.corners):
            continue
        far = other.corners.min(axis=0) > high
        if far.any() or (other.corners.max(axis=0) < low).any():
            continue
        if mine.meets(other):
            return name
    return ""


def check_places(
    keys: Sequence[str], bodies: Sequence[Outline], places: Sequence[Pose], scene: Scene
) -> None:
    """Raise SchemaError for a robot that starts inside of something else.

    keys: of the robots, for the message      places: x and y in m, heading in rad
    """
    there = [*of_scene(scene)]
    for key, body, place in zip(keys, bodies, places, strict=True):
        mine = body.at(place)
        if name := met(mine, there):
            x, y, _ = place
            raise SchemaError(
                f"{key} starts at x = {x:g} m, y = {y:g} m, where {name} is; one place "
                f"holds one of them: give {key} another `initial`, such as "
                f"{_free(body, there)}. (R0219)"
            )
        there.append((key, mine))


def check_free(
    key: str, body: Outline, place: Pose, others: Iterable[tuple[str, Outline]]
) -> None:
    """Raise AgentError for a reset to a place where another robot is now."""
    if name := met(body.at(place), others):
        raise AgentError(
            key,
            f"{name} is where it starts: drive that away, or reset the whole "
            "world. (R0219)",
        )


def _free(body: Outline, there: Sequence[tuple[str, Outline]]) -> str:
    """Return a free place for the robot, as a user writes it."""
    step = max(2 * body.reach, 0.01)
    for ring in range(1, 10):
        for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            place = (round(x * ring * step, 2), round(y * ring * step, 2), 0.0)
            if not met(body.at(place), there):
                return f"{{ x = {place[0]}, y = {place[1]} }}"
    return "{ x = 1.0, y = 1.0 }"


def outline_of(shapes: Sequence[Array], *, joined: bool) -> list[list[list[float]]]:
    """Return the corners of each of these shapes, or of all together, in 0.1 mm.

    shapes: points (n, 3) of each, m
    """
    groups = [shapes] if joined else [[one] for one in shapes]
    found = [_outline(group, 0.0).corners for group in groups if group]
    return [np.round(one, 4).tolist() for one in found]


def corners(shape: Shape, at: Array, turn: Array) -> Array:
    """Return points (n, 3) whose convex hull is the shape, or nearly so."""
    match shape:
        case Box(size):
            signs = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T
            return np.asarray(at + (signs * size) @ turn.T)
        case Sphere(radius):
            ring = np.column_stack([_ring(radius), np.zeros(ROUND)])
            poles = np.array([[0.0, 0.0, radius], [0.0, 0.0, -radius]])
            return np.asarray(at + np.concatenate([ring, poles]))
        case Cylinder(radius, length, axis):
            along = turn @ np.array(axis)
            # Two directions across the axis, one of them horizontal.
            flat = np.array([-along[1], along[0], 0.0])
            norm = float(np.sqrt(flat @ flat))
            flat = flat / norm if norm > 1e-9 else np.array([1.0, 0.0, 0.0])
            ring = _ring(radius) @ np.array([flat, np.cross(along, flat)])
            ends = along * length / 2
            return np.asarray(at + np.concatenate([ring - ends, ring + ends]))


def _ring(radius: float) -> Array:
    turns = [sincos(2 * pi * n / ROUND) for n in range(ROUND)]
    return radius * np.array([[c, s] for s, c in turns])


def _outline(points: Sequence[Array], height: float) -> Outline:
    if not points:
        return Outline(np.zeros((0, 2)), 0.0, 0.0, 0.0)
    every = np.concatenate(points)
    edge = _hull([(float(x), float(y)) for x, y, _ in every])
    heights = every[:, 2] + height
    reach = float(np.sqrt((edge**2).sum(axis=1).max()))
    return Outline(edge, float(heights.min()), float(heights.max()), reach)


def _hull(points: Sequence[tuple[float, float]]) -> Array:
    """Return the convex hull's corners, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted(set(points))

    def half(some: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
        chain: list[tuple[float, float]] = []
        for x, y in some:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-2:]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                    break
                chain.pop()
            chain.append((x, y))
        return chain[:-1]

    return np.array(half(ordered) + half(reversed(ordered)) or ordered)


def _overlap(corners: Array, others: Array) -> float:
    """Return how far the second outline is inside the first's nearest edge, m."""
    if not len(corners) or not len(others):
        return 0.0
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([edges[:, 1], -edges[:, 0]])
    normals /= np.sqrt((normals**2).sum(axis=1, keepdims=True)) + 1e-300
    # Across each edge: the second outline's nearest corner, and the edge.
    nearest, edge = (normals @ others.T).min(axis=1), (normals * corners).sum(axis=1)
    return float((edge - nearest).min())

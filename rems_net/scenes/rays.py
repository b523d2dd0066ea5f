"""Rays: distances from a point to solids along a line, without any engine."""

from collections.abc import Callable, Iterable, Sequence
from math import inf, sqrt

import numpy as np

from rems_net.bodies.body import Body, Ray, Switch
from rems_net.bodies.parts import Array, Box, Cylinder, Shape, Sphere, Vector
from rems_net.scenes.outline import Pose
from rems_net.scenes.scene import Solid, upright

#: stands for a direction's component of 0, to avoid a division by 0
LITTLE = 1e-12


def stand(pose: Pose, height: float) -> tuple[Array, Array]:
    """Return position and rotation of a robot with this pose, body to world."""
    x, y, heading = pose
    return np.array([x, y, height]), upright(heading)


#: Returns the distance to the nearest obstacle, m, from a start in a direction; at
#: least the reach, if there is none so far.
Look = Callable[[Array, Array, float], float]


def sensed(
    body: Body, position: Array, turn: Array, look: Look
) -> dict[str, float | bool]:
    """Return the values of the rays and switches of a body, by sensor.

    position, turn: its pose, from `stand`
    """

    def found(at: Vector, direction: Vector, reach: float) -> float:
        start, way = position + turn @ np.array(at), turn @ np.array(direction)
        return min(look(start, way, reach), reach)

    seen: dict[str, float | bool] = {}
    for sensor in body.sensors:
        if isinstance(sensor, Ray):
            seen[sensor.name] = found(sensor.at, sensor.direction, sensor.reach)
        elif isinstance(sensor, Switch):
            far = (found(*ray, sensor.reach) for ray in sensor.rays)
            near = any(distance < sensor.reach for distance in [*far])
            seen[sensor.name] = near != sensor.empty
    return seen


class Boxes:
    """Boxes that never move, tested all at once."""

    def __init__(self, solids: Iterable[Solid]):
        boxes = [solid for solid in solids if isinstance(solid.shape, Box)]
        self._any = bool(boxes)
        if boxes:
            self._at = np.array([box.at for box in boxes])
            self._back = np.array([box.turn.T for box in boxes])
            sizes = [box.shape.size for box in boxes if isinstance(box.shape, Box)]
            self._half = np.array(sizes) / 2

    def distance(self, start: Array, direction: Array) -> float:
        """Return the distance to the nearest box, m; infinite if the ray meets none."""
        if not self._any:
            return inf
        begin = np.einsum("nij,nj->ni", self._back, start - self._at)
        ahead = self._back @ direction
        ahead = np.where(np.abs(ahead) < LITTLE, LITTLE, ahead)
        near = (-np.copysign(self._half, ahead) - begin) / ahead
        far = (np.copysign(self._half, ahead) - begin) / ahead
        enter, leave = near.max(axis=1), far.min(axis=1)
        met = enter[(enter <= leave) & (enter > 0.0)]
        return float(met.min()) if len(met) else inf


def distance(start: Array, direction: Array, solids: Sequence[Solid]) -> float:
    """Return the distance to the nearest solid or the floor, m; infinite for none.

    Solids are met from outside: a solid around the start is ignored.
    """
    down = float(direction[2])
    nearest = -float(start[2]) / down if down < 0.0 else inf
    boxes = Boxes(solids)
    nearest = min(nearest, boxes.distance(start, direction))
    for solid in solids:
        if not isinstance(solid.shape, Box):
            begin = solid.turn.T @ (start - solid.at)
            ahead = solid.turn.T @ direction
            nearest = min(nearest, _to(solid.shape, begin, ahead))
    return nearest


def _to(shape: Shape, begin: Array, ahead: Array) -> float:
    match shape:
        case Sphere(radius):
            return _round(begin, ahead, radius)
        case Cylinder(radius, length, axis):
            return _barrel(begin, ahead, radius, length / 2, axis)
        case _:
            return inf


def _round(begin: Array, ahead: Array, radius: float) -> float:
    """Return where a ray enters the ball about the origin, in lengths of `ahead`."""
    square = float(ahead @ ahead)
    if square < LITTLE:
        return inf
    along = float(begin @ ahead)
    under = along * along - square * (float(begin @ begin) - radius * radius)
    if under < 0.0:
        return inf
    enter = (-along - sqrt(under)) / square
    return enter if enter > 0.0 else inf


def _barrel(
    begin: Array, ahead: Array, radius: float, half: float, axis: Vector
) -> float:
    along = np.array(axis)
    up, climb = float(begin @ along), float(ahead @ along)
    # Seen along its axis, the cylinder is a circle.
    side = _round(begin - up * along, ahead - climb * along, radius)
    best = side if abs(up + side * climb) <= half else inf
    if abs(climb) > LITTLE:
        enter = (-half if climb > 0 else half) - up
        enter /= climb
        point = begin + enter * ahead
        point = point - float(point @ along) * along
        if enter > 0.0 and float(point @ point) <= radius * radius:
            best = min(best, enter)
    return best

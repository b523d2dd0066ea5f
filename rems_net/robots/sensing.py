"""Values of sensors without an engine: on a flat floor, inside a round wall.

Numbers, or arrays of them for a swarm; a switch takes numbers only.
"""

from collections.abc import Iterable
from math import sqrt
from typing import Any

import numpy as np

from rems_net.bodies import sensors
from rems_net.bodies.body import Sensor, Vector
from rems_net.defdict import (
    Field,
    Schema,
    acceleration,
    angle,
    angular_velocity,
    array,
    boolean,
    length,
    number,
)
from rems_net.errors import SchemaError

#: x and y of the robot's origin, m, and the cosine and sine of its heading
Pose = tuple[Any, Any, Any, Any]


def sensed(name: str, senses: Iterable[Sensor], source: str) -> Schema:
    """Return the schema of these sensors' values.

    source: of the fact that the robot has these sensors at these places
    Raises SchemaError for a sensor that `read` does not know.
    """
    return Schema(name, {sense.name: _field(sense, source) for sense in senses})


def _field(sense: Sensor, source: str) -> Field:
    match sense:
        case sensors.Ray(_, _, _, reach):
            doc = f"to what is there, {reach:g} m at most; {source}"
            return length(range=(0, reach), doc=doc)
        case sensors.Switch(_, _, reach, empty):
            seen = "nothing" if empty else "something"
            return boolean(doc=f"{seen} within {reach * 1000:g} mm; {source}")
        case sensors.Gyro():
            return angular_velocity(doc=f"counter-clockwise; {source}")
        case sensors.Accelerometer():
            return acceleration(doc=f"9.81 upwards at rest; {source}")
        case sensors.Compass():
            return number(doc=f"of the unit vector to the north; {source}")
        case sensors.Encoder():
            return angle(doc=f"of the wheel since the start, not wrapped; {source}")
        case sensors.Camera():
            doc = f"red, green, blue by row and column; black without physics; {source}"
            return array(sense.shape, dtype="u1", doc=doc)
    raise _unknown(sense)


def read(
    sense: Sensor,
    pose: Pose,
    turning: Any,
    wheels: Any,
    height: float,
    radius: float,
) -> Any:
    """Return the value of a sensor.

    turning: rate of the heading, rad/s      wheels: angle of each, rad, by its name
    height: of the robot's origin above the floor, m      radius: of the wall, m
    """
    match sense:
        case sensors.Ray(_, at, direction, reach):
            return see(at, direction, reach, pose, height, radius)
        case sensors.Switch(_, rays, reach, empty):
            seen = (see(a, d, reach, pose, height, radius) < reach for a, d in rays)
            return any(seen) != empty
        case sensors.Gyro(_, axis):
            return axis[2] * turning
        case sensors.Compass(_, axis):
            _, _, c, s = pose
            return axis[0] * s + axis[1] * c
        case sensors.Encoder(_, joint):
            return wheels[joint]
    raise _unknown(sense)


def _unknown(sense: Sensor) -> SchemaError:
    return SchemaError(
        f"A robot on wheels senses by Ray, Switch, Gyro, Accelerometer, Compass, "
        f"Encoder and Camera, not by {sense}. Give it a field in a Schema of your own, "
        "and a line in measure(). (R0215)"
    )


def see(
    at: Vector,
    direction: Vector,
    reach: float,
    pose: Pose,
    height: float,
    radius: float,
) -> Any:
    """Return the distance along a ray to the floor or the wall, m, at most `reach`."""
    x, y, c, s = pose
    ahead, left, up = direction
    level = sqrt(ahead * ahead + left * left)
    floor = min((height + at[2]) / -up, reach) if up < 0 else reach
    if level < 1e-9:
        return floor
    ahead, left = ahead / level, left / level
    x, y = x + at[0] * c - at[1] * s, y + at[0] * s + at[1] * c
    c, s = ahead * c - left * s, ahead * s + left * c
    wall = to_wall(x, y, c, s, radius, reach * level) / level
    return min(wall, floor) if isinstance(wall, float) else np.minimum(wall, floor)


def to_wall(x: Any, y: Any, c: Any, s: Any, radius: float, reach: float) -> Any:
    """Return the distance from (x, y) along (c, s) to the round wall, m."""
    along = x * c + y * s
    square = radius * radius - x * x - y * y + along * along
    if isinstance(square, float):  # one robot
        if square < 0 or radius == 0:
            return reach
        half = sqrt(square)
        near, far = -along - half, -along + half
        return min(near if near > 0 else far if far > 0 else reach, reach)
    half = np.sqrt(np.maximum(square, 0.0))
    near, far = -along - half, -along + half
    seen = np.where(near > 0, near, np.where(far > 0, far, reach))
    return np.where((square < 0) | (radius == 0), reach, np.minimum(seen, reach))

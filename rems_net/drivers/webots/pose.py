"""Where a model of Webots is, as a definition counts it: x, y and heading.

A rotation is a matrix (3, 3), model to world. The world is ENU: x and y lie flat, z is
up.
"""

from __future__ import annotations

from math import pi

import numpy as np

from rems_net.kinematics.rotation import rotation_vector
from rems_net.maths import atan2, sincos
from rems_net.worlds.devices import Devices
from rems_net.worlds.parts import Array


def heading(rotation: Array, devices: Devices) -> float:
    """Return the heading, rad, -pi to pi."""
    ahead = rotation @ np.array(devices.ahead)
    return float(atan2(float(ahead[1]), float(ahead[0])))


def origin(position: Array, rotation: Array, devices: Devices) -> Array:
    """Return where the definition's origin is in the world (3,), m."""
    at: Array = position + rotation @ np.array(devices.origin)
    return at


def placed(
    x: float, y: float, turned: float, height: float, upright: Array, devices: Devices
) -> tuple[Array, Array]:
    """Return position and rotation of the model whose origin is at x, y, turned so.

    height: of the origin above the floor, m      upright: a rotation in which it stands
    """
    sine, cosine = sincos(turned - heading(upright, devices))
    about_z = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    rotation = about_z @ upright
    return np.array([x, y, height]) - rotation @ np.array(devices.origin), rotation


def axis_angle(rotation: Array) -> list[float]:
    """Return a rotation as Webots' fields have it: an axis of length 1, and rad."""
    vector = rotation_vector(rotation)
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return [0.0, 0.0, 1.0, 0.0]
    return [*(float(part) / angle for part in vector), angle]


def wrap(angle: float) -> float:
    """Return an angle, rad, between -pi and pi."""
    return (angle + pi) % (2 * pi) - pi

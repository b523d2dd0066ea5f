"""Where a model of Webots is, as a definition counts it: x, y and heading.

A rotation is a matrix (3, 3), model to world. The world is ENU: x and y lie flat, z is
up.
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np

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
    m = rotation
    trace = float(np.trace(m))
    # Of the four ways to a quaternion the one that divides by the largest number.
    biggest = int(np.argmax([trace, m[0, 0], m[1, 1], m[2, 2]]))
    if biggest == 0:
        w = sqrt(1 + trace) / 2
        rest = [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]
        vector = np.array(rest) / (4 * w)
    else:
        i = biggest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        big = sqrt(max(0.0, 1 + m[i, i] - m[j, j] - m[k, k])) / 2
        vector = np.zeros(3)
        vector[i] = big
        vector[j] = (m[j, i] + m[i, j]) / (4 * big)
        vector[k] = (m[k, i] + m[i, k]) / (4 * big)
        w = float(m[k, j] - m[j, k]) / (4 * big)
    length = float(np.linalg.norm(vector))
    if length < 1e-12:
        return [0.0, 0.0, 1.0, 0.0]
    angle = float(2 * atan2(length, w))
    return [*(float(part) / length for part in vector), angle]


def wrap(angle: float) -> float:
    """Return an angle, rad, between -pi and pi."""
    return (angle + pi) % (2 * pi) - pi

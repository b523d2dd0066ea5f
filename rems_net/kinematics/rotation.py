"""Rotations as nine entries, row by row: of numbers, or of arrays of them.

They use only +, -, * and our own sines, so a pose has the same bits on every computer,
and for many robots at once the same bits as for each alone.
"""

from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.maths import atan2, hypot

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
#: three entries, and nine; each a float or an array
Three = tuple[Any, Any, Any]
Nine = tuple[Any, Any, Any, Any, Any, Any, Any, Any, Any]

UNTURNED: Nine = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def wrapped(angle: float) -> float:
    """Return an angle from -pi to pi, rad."""
    return (angle + pi) % (2 * pi) - pi


def about(axis: Vector, sine: Any, cosine: Any) -> Nine:
    """Return the rotation about a unit vector by the angle of this sine and cosine."""
    x, y, z = axis
    rest = 1.0 - cosine
    xy, xz, yz = x * y * rest, x * z * rest, y * z * rest
    sx, sy, sz = x * sine, y * sine, z * sine
    return (
        *(x * x * rest + cosine, xy - sz, xz + sy),
        *(xy + sz, y * y * rest + cosine, yz - sx),
        *(xz - sy, yz + sx, z * z * rest + cosine),
    )


def product(a: Nine, b: Nine) -> Nine:
    """Return the rotation `b` followed by `a`."""
    return (
        a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
        a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
        a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
        a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
        a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
        a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
        a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
    )


def transposed(a: Nine) -> Nine:
    """Return the inverse rotation."""
    return a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]


def turned(a: Nine, v: Sequence[Any]) -> Three:
    """Return a vector of the turned frame, in the outer frame."""
    x, y, z = v
    return (
        a[0] * x + a[1] * y + a[2] * z,
        a[3] * x + a[4] * y + a[5] * z,
        a[6] * x + a[7] * y + a[8] * z,
    )


def added(a: Three, b: Three) -> Three:
    """Return the sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def cross(a: Sequence[Any], b: Sequence[Any]) -> Three:
    """Return the cross product of two vectors."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def three(vector: Array) -> Three:
    """Return the entries of a (3,) array."""
    x, y, z = vector.tolist()
    return x, y, z


def nine(rotation: Array) -> Nine:
    """Return the entries of a (3, 3) array."""
    a, b, c, d, e, f, g, h, i = rotation.ravel().tolist()
    return a, b, c, d, e, f, g, h, i


def rotation_vector(rotation: Array) -> Array:
    """Return the axis of a rotation (3, 3) times its angle, (3,), 0 to pi rad."""
    r = rotation
    twice = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    sine = float(hypot(float(hypot(float(twice[0]), float(twice[1]))), float(twice[2])))
    cosine = float(r[0, 0] + r[1, 1] + r[2, 2]) - 1.0
    angle: float = atan2(sine, cosine)
    if sine > 1e-6:
        return twice * (angle / sine)
    if cosine > 0:
        return twice / 2.0
    # Near half a turn the difference is 0; the sum has the axis, but not its sign.
    square = (r + r.T) / 2.0 + np.eye(3)
    column: Array = square[:, int(np.argmax(np.diag(square)))]
    axis = column / np.sqrt(column @ column)
    return axis * (angle if axis @ twice >= 0 else -angle)

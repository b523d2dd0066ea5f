"""Plane: the pose of a level marker from its corners in a picture.

The marker's height is known, so x, y and heading are left, and its printed size. A
free pose has six numbers, and flips: a small square is 12 mm off in place of 0.1 mm.

A corner is where two edges meet, and a detector fits a line to each edge. The error of
a line is an offset and a tilt; fitted to even points, an edge's end deviates by its
tilt sqrt(3) times as much as by its offset. So deviations of corners are weighted by
edges, which makes the covariance as large as the errors are. OpenCV refines each corner
by itself, so there both deviate alike.
"""

from dataclasses import dataclass

import numpy as np

from rems_net.bodies.marker import Marker
from rems_net.bodies.parts import Array
from rems_net.eyes.view import View
from rems_net.kinematics.rotation import wrapped
from rems_net.maths import atan2, sincos

#: steps of Gauss and Newton; the start is the corners' own back-projection
STEPS = 4
#: measured numbers that are left over in one marker: 8 of 4 corners, less 4
SPARE = 4
#: family -> deviation of an edge's end by the edge's tilt, as a multiple of that by
#: its offset: of AprilTag's lines; 1 for corners that are found one by one
TILTS = {"aruco4x4": 1.0}
TILT = 3**0.5
#: family -> deviation of the heading as a multiple of that by the corners' deviations.
#: OpenCV's refinement turns all four corners alike, which the corners do not show.
TWISTS = {"aruco4x4": 1.9}


@dataclass(frozen=True, slots=True)
class Sighting:
    """One marker in one picture.

    pose: (3,), x and y in m and heading in rad, of the marker's owner
    spread: its covariance (3, 3) if edges are offset by 1 px, standard deviation
    misfit: sum of the squares of its edges' offsets and tilts from the fit, px2
    scale, unsure: measured edge of the marker as a share of its size, and the standard
        deviation of that if edges are offset by 1 px
    """

    pose: Array
    spread: Array
    misfit: float
    scale: float
    unsure: float


def corners(marker: Marker) -> Array:
    """Return the corners (4, 2) in the owner's frame: lower left, lower right, ..., m.

    The top of the picture points along the marker's heading.
    """
    half = marker.size / 2
    square = half * np.array([(-1, 1), (-1, -1), (1, -1), (1, 1)])
    return np.array(marker.at[:2]) + square @ _turn(marker.heading).T


def sight(view: View, marker: Marker, height: float, pixels: Array) -> Sighting | None:
    """Return the pose of a marker's owner from its corners (4, 2) in a picture.

    height: of the marker above the floor, m. None: the corners cannot lie there.
    """
    straight = view.straightened(pixels)
    met = view.meet(straight, height)
    if met is None:
        return None
    own = corners(marker)
    ahead = (met[2] + met[3] - met[0] - met[1]) / 2
    side = (met[1] + met[2] - met[0] - met[3]) / 2
    heading = float(atan2(*ahead[::-1].tolist())) - marker.heading
    middle = met.mean(axis=0) - _turn(heading) @ own.mean(axis=0)
    edge = float(np.sqrt(np.sqrt((ahead @ ahead) * (side @ side))))
    found = np.array([*middle, heading, edge / marker.size])
    weights = _by_edges(straight, TILTS.get(marker.family, TILT))
    for _ in range(STEPS):
        missing, by = _weighted(view, own, marker, found, height, straight, weights)
        step, *_ = np.linalg.lstsq(by, missing, rcond=None)
        found += step
    missing, by = _weighted(view, own, marker, found, height, straight, weights)
    found[2] = wrapped(found[2])
    spread: Array = np.linalg.inv(by.T @ by).astype(float)
    twist = TWISTS.get(marker.family, 1.0)
    spread[2] *= twist
    spread[:, 2] *= twist
    misfit, unsure = float(missing @ missing), float(np.sqrt(spread[3, 3]))
    return Sighting(found[:3], spread[:3, :3], misfit, float(found[3]), unsure)


def _by_edges(pixels: Array, tilt: float) -> Array:
    """Return the matrix (8, 8) from corners' deviations to edges' offsets and tilts.

    Tilts are divided by `tilt`, so that all eight deviate alike.
    """
    matrix = np.zeros((8, 8))
    for edge in range(4):
        first, second = edge, (edge + 1) % 4
        x, y = pixels[second] - pixels[first]
        across = np.array([-y, x]) / np.sqrt(x * x + y * y) / 2
        for row, sign, share in ((2 * edge, 1, 1), (2 * edge + 1, -1, tilt)):
            matrix[row, 2 * first : 2 * first + 2] = sign * across / share
            matrix[row, 2 * second : 2 * second + 2] = across / share
    return matrix


def _weighted(
    view: View,
    own: Array,
    marker: Marker,
    found: Array,
    height: float,
    straight: Array,
    weights: Array,
) -> tuple[Array, Array]:
    """Return the weighted deviations (8,) of corners, and slopes (8, 4) of the fit.

    found: x, y, heading, and the scale of the marker about its own middle
    """
    turn = _turn(float(found[2]))
    middle = np.array(marker.at[:2])
    square = (own - middle) @ turn.T
    away = found[3] * square + turn @ middle
    points = np.column_stack([away + found[:2], np.full(len(own), height)])
    pixels, by = view.project(points)
    # A turn moves each corner across its distance from the owner's middle.
    turning = by[:, :, 1] * away[:, :1] - by[:, :, 0] * away[:, 1:]
    growing = by[:, :, 0] * square[:, :1] + by[:, :, 1] * square[:, 1:]
    slopes = np.dstack([by[:, :, :2], turning[:, :, None], growing[:, :, None]])
    missing = weights @ (straight - pixels).ravel()
    return missing, weights @ slopes.reshape(-1, 4)


def _turn(angle: float) -> Array:
    s, c = sincos(angle)
    return np.array([[c, -s], [s, c]])

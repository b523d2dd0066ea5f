"""Place: where a camera is, from markers at known places in one picture."""

import numpy as np

from rems_net.bodies.lens import Lens
from rems_net.bodies.parts import Array
from rems_net.eyes.view import View
from rems_net.kinematics.rotation import about
from rems_net.maths import atan2, hypot, sincos

#: markers that are needed: with fewer, a wrong one is not noticed
FEWEST = 4
#: steps of Levenberg and Marquardt from the start by a homography
STEPS = 40


def place_of(view: View, points: Array, pixels: Array) -> tuple[View, float]:
    """Return where a camera is, from points (n, 3) of the world and their pixels.

    view: where it may be. If the points are on one level plane, it may be anywhere.
    Also returns the deviation that is left, px, root of the mean square.
    """
    straight = view.straightened(pixels)
    begin = _begin(view.lens, points, straight)
    tried = [_refined(one, points, straight) for one in (begin, view)]
    # A camera that is reflected in the plane, with the points behind it, has the same
    # pixels.
    return min(tried, key=lambda one: (_behind(one[0], points), one[1]))


def _behind(view: View, points: Array) -> bool:
    """Return whether one of the points (n, 3) lies behind the camera."""
    return bool(((points - view.eye) @ view.turn[2] <= 0).any())


def _refined(view: View, points: Array, straight: Array) -> tuple[View, float]:
    """Return the view with the least deviation near a first one, and the deviation."""
    there, by = view.project(points)
    damping = 1e-3
    for _ in range(STEPS):
        # A turn by a small vector w moves a point p, seen from the eye, by p x w.
        seen = points - view.eye
        slopes = np.concatenate([-by, np.cross(by, seen[:, None, :])], axis=2)
        flat = slopes.reshape(-1, 6)
        square = flat.T @ flat
        square += damping * np.diag(np.diag(square))
        step = np.linalg.solve(square, flat.T @ (straight - there).ravel())
        tried = View(view.lens, view.eye + step[:3], view.turn @ _about(step[3:]).T)
        new, new_by = tried.project(points)
        if ((straight - new) ** 2).sum() <= ((straight - there) ** 2).sum():
            view, there, by = tried, new, new_by
            damping /= 10
        else:
            damping *= 10
    left = float(np.sqrt(((straight - there) ** 2).mean()))
    return view, left


def angles(turn: Array) -> tuple[float, float, float]:
    """Return heading, pitch and roll, rad, of a view's turn (rows right, down, ahead).

    Where it looks straight down or up, the roll is 0.
    """
    right, down, ahead = turn.tolist()
    x, y, z = ahead
    level = float(hypot(x, y))
    pitch = float(atan2(z, level))
    if level < 1e-6:
        sign = -1.0 if z > 0 else 1.0
        return float(atan2(-sign * down[1], -sign * down[0])), pitch, 0.0
    roll = float(atan2(-right[2], -down[2]))
    return float(atan2(y, x)), pitch, roll


def _begin(lens: Lens, points: Array, straight: Array) -> View:
    """Return a first view, by the homography from the points' mean plane."""
    height = float(points[:, 2].mean())
    slopes = (straight - (lens.cx, lens.cy)) / (lens.fx, lens.fy)
    flat = np.column_stack([points[:, :2], np.ones(len(points))])
    zero = np.zeros_like(flat)
    rows = [
        np.column_stack([flat, zero, -slopes[:, :1] * flat]),
        np.column_stack([zero, flat, -slopes[:, 1:] * flat]),
    ]
    _, _, axes = np.linalg.svd(np.concatenate(rows))
    matrix = axes[-1].reshape(3, 3)
    if (flat @ matrix[2]).mean() < 0:
        matrix = -matrix
    scale = np.sqrt(np.sqrt((matrix[:, 0] ** 2).sum() * (matrix[:, 1] ** 2).sum()))
    x, y, at = (matrix / scale).T
    u, _, v = np.linalg.svd(np.column_stack([x, y, np.cross(x, y)]))
    turn = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
    eye = -turn.T @ at + (0, 0, height)
    return View(lens, eye, turn)


def _about(vector: Array) -> Array:
    """Return the rotation (3, 3) about a vector by its length, rad."""
    angle = float(np.sqrt(vector @ vector))
    axis = (vector / (angle or 1.0)).tolist()
    return np.reshape(about(axis, *sincos(angle)), (3, 3))

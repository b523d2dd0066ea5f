"""Optics: what a lens and a chip make of an ideal picture: distortion, blur, grain."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from hashlib import sha256
from math import ceil

import numpy as np
from numpy.typing import NDArray

from rems_net.bodies.lens import Lens
from rems_net.bodies.parts import Array
from rems_net.bodies.sensors import Camera
from rems_net.drivers.physics.engine import Picture

Floats = NDArray[np.float32]

#: standard deviations that a blur reaches to each side
REACH = 3.0


def ideal(camera: Camera) -> Camera:
    """Return the camera without distortion that an engine draws in its place."""
    if camera.lens is None or not camera.lens.bent:
        return camera
    lens = camera.lens.straight()
    return replace(camera, lens=lens, width=lens.width, height=lens.height)


def distorted(camera: Camera) -> Callable[[Picture], Picture]:
    """Return the function that turns the ideal picture into that of the camera."""
    if camera.lens is None or not camera.lens.bent:
        return lambda picture: picture
    corner, shares = _places(camera.lens)

    def bend(picture: Picture) -> Picture:
        (rows, columns), mixed = corner, np.zeros(camera.shape, np.float32)
        for (down, right), share in shares:
            mixed += share * picture[rows + down, columns + right]
        return (mixed + 0.5).astype(np.uint8)

    return bend


@cache
def _places(
    lens: Lens,
) -> tuple[tuple[Array, Array], list[tuple[tuple[int, int], Array]]]:
    """Return the ideal picture's pixels around each of the lens's, and their shares."""
    straight = lens.straight()
    rows, columns = np.mgrid[: lens.height, : lens.width]
    pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(float)
    slopes = lens.slopes(pixels)
    at = slopes * (straight.fx, straight.fy) + (straight.cx, straight.cy)
    shape = (lens.height, lens.width)
    x, y = (at[:, i].reshape(shape) for i in (0, 1))
    left = np.clip(np.floor(x).astype(int), 0, straight.width - 2)
    upper = np.clip(np.floor(y).astype(int), 0, straight.height - 2)
    right, down = x - left, y - upper
    shares = [
        ((i, j), (abs(1 - i - down) * abs(1 - j - right)).astype(np.float32)[..., None])
        for i in (0, 1)
        for j in (0, 1)
    ]
    return (upper, left), shares


class Chip:
    """A camera's chip: blurs a picture, and adds grain; the same for the same seed.

    The grain is one of brightness: red, green and blue of a pixel get the same.
    """

    def __init__(self, camera: Camera, seed: str):
        self._grain = camera.grain
        number = int.from_bytes(sha256(seed.encode()).digest()[:8], "little")
        self._random = np.random.default_rng(number)
        taps = np.arange(-ceil(REACH * camera.blur), ceil(REACH * camera.blur) + 1)
        bell = np.exp(-((taps / (camera.blur or 1.0)) ** 2) / 2)
        self._bell = (bell / bell.sum()).astype(np.float32)

    def take(self, picture: Picture) -> Picture:
        """Return the picture as the chip gives it."""
        whole = picture.astype(np.float32)
        for axis in (0, 1):
            whole = _blurred(whole, self._bell, axis)
        if self._grain:
            shape = picture.shape[:2]
            grain = self._random.standard_normal(shape, np.float32)
            whole += np.float32(self._grain) * grain[:, :, None]
        return (np.clip(whole, 0, 255) + np.float32(0.5)).astype(np.uint8)


def _blurred(whole: Floats, bell: Floats, axis: int) -> Floats:
    reach = len(bell) // 2
    if not reach:
        return whole
    rim = [(0, 0)] * whole.ndim
    rim[axis] = (reach, reach)
    wide, size = np.pad(whole, rim, "edge"), whole.shape[axis]
    mixed = np.zeros_like(whole)
    for number, share in enumerate(bell):
        part = wide[number : number + size] if axis == 0 else wide[:, number:][:, :size]
        mixed += share * part
    return mixed

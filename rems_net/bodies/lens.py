"""Lens: from directions before a camera to pixels of its picture, and back.

Frame of a camera: x to the right, y down, z ahead. The middle of the upper left pixel
is at (0, 0), and that of the lower right one at (width - 1, height - 1), as in OpenCV.
"""

from dataclasses import dataclass

import numpy as np

from rems_net.bodies.parts import Array
from rems_net.errors import SchemaError
from rems_net.maths import tan

#: steps of the fixed point that removes distortion: 1e-6 px for a lens of 90 degrees
STEPS = 20
#: number of distortion's coefficients, in OpenCV's order: k1, k2, p1, p2, k3
BENDS = 5


@dataclass(frozen=True, slots=True)
class Lens:
    """A pinhole with distortion, for a picture of `width` by `height` pixels.

    fx, fy: pixels for a slope of 1      cx, cy: pixel of the optical axis
    bends: k1, k2, p1, p2 and k3, as OpenCV computes them
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    bends: tuple[float, ...] = (0.0,) * BENDS

    def __post_init__(self) -> None:
        if not (self.fx > 0 and self.fy > 0):
            raise SchemaError(
                "A lens has fx and fy above 0, in pixels, such as 600; got "
                f"{self.fx:g} and {self.fy:g}. (R1101)"
            )
        inside = -1 < self.cx < self.width and -1 < self.cy < self.height
        if not inside:
            raise SchemaError(
                f"A lens has its axis in the picture of {self.width} by {self.height}, "
                f"near {(self.width - 1) / 2:g}, {(self.height - 1) / 2:g}; got cx, cy "
                f"= {self.cx:g}, {self.cy:g}. (R1101)"
            )

    @classmethod
    def seeing(cls, width: int, height: int, field_of_view: float) -> "Lens":
        """Return an ideal lens with this field of view from left to right, rad."""
        f = width / 2 / float(tan(field_of_view / 2))
        return cls(width, height, f, f, (width - 1) / 2, (height - 1) / 2)

    @property
    def bent(self) -> bool:
        """Whether the lens has distortion."""
        return any(self.bends)

    def bend(self, slopes: Array) -> Array:
        """Return where distortion puts slopes x/z and y/z: (n, 2) to (n, 2)."""
        if not self.bent:
            return slopes
        k1, k2, p1, p2, k3 = self.bends
        x, y = slopes[:, 0], slopes[:, 1]
        r = x * x + y * y
        radial = 1 + r * (k1 + r * (k2 + r * k3))
        return np.column_stack(
            [
                x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x),
                y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y,
            ]
        )

    def straighten(self, slopes: Array) -> Array:
        """Return the slopes that distortion puts at `slopes`: the inverse of `bend`."""
        if not self.bent:
            return slopes
        found = slopes.copy()
        for _ in range(STEPS):
            found += slopes - self.bend(found)
        return found

    def pixels(self, points: Array) -> Array:
        """Return the pixels (n, 2) of points (n, 3) in the camera's frame, z > 0."""
        slopes = self.bend(points[:, :2] / points[:, 2:])
        return slopes * (self.fx, self.fy) + (self.cx, self.cy)

    def slopes(self, pixels: Array) -> Array:
        """Return the slopes (n, 2), x/z and y/z, of the light that meets pixels."""
        return self.straighten((pixels - (self.cx, self.cy)) / (self.fx, self.fy))

    def straight(self) -> "Lens":
        """Return a lens without distortion whose picture has all that this one has."""
        if not self.bent:
            return self
        u, v = np.arange(self.width), np.arange(self.height)
        rim = [np.column_stack([u, np.full(len(u), y)]) for y in (0, self.height - 1)]
        rim += [np.column_stack([np.full(len(v), x), v]) for x in (0, self.width - 1)]
        seen = self.slopes(np.concatenate(rim).astype(float)) * (self.fx, self.fy)
        low, high = np.floor(seen.min(axis=0)) - 1, np.ceil(seen.max(axis=0)) + 1
        width, height = (int(size) + 1 for size in high - low)
        return Lens(width, height, self.fx, self.fy, -float(low[0]), -float(low[1]))

    def edges(self) -> tuple[float, float, float, float]:
        """Return slopes of the picture's edges: left, right, bottom and top."""
        return (
            (-0.5 - self.cx) / self.fx,
            (self.width - 0.5 - self.cx) / self.fx,
            (self.cy + 0.5 - self.height) / self.fy,
            (self.cy + 0.5) / self.fy,
        )

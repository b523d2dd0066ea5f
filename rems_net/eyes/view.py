"""View: a lens at its place, between points of the world and pixels."""

from dataclasses import dataclass

import numpy as np

from rems_net.bodies.lens import Lens
from rems_net.bodies.parts import Array
from rems_net.kinematics.pose import Pose


def turn_of(heading: float, pitch: float, roll: float) -> Array:
    """Return a rotation (3, 3), its columns ahead, left and up; angles in rad.

    heading: about z; pitch: up from the floor; roll: about ahead
    """
    return Pose.of(yaw=heading, pitch=-pitch, roll=roll).rotation


@dataclass(frozen=True, slots=True)
class View:
    """A lens at a place in the world.

    eye: (3,), m      turn: (3, 3), its rows right, down and ahead, in the world's frame
    """

    lens: Lens
    eye: Array
    turn: Array

    @classmethod
    def at(cls, lens: Lens, eye: Array, turn: Array) -> "View":
        """Return the view from `eye`; the columns of turn are ahead, left and up."""
        ahead, left, up = turn.T
        return cls(lens, eye, np.stack([-left, -up, ahead]))

    def straightened(self, pixels: Array) -> Array:
        """Return pixels (n, 2) as a lens without distortion would have them."""
        lens = self.lens
        return lens.slopes(pixels) * (lens.fx, lens.fy) + (lens.cx, lens.cy)

    def project(self, points: Array) -> tuple[Array, Array]:
        """Return points (n, 3) as straight pixels (n, 2), and their slopes (n, 2, 3).

        The slopes are in pixels for a metre of x, y and z.
        """
        lens = self.lens
        right, down, ahead = self.turn
        x, y, z = ((points - self.eye) @ self.turn.T).T
        pixels = np.column_stack([lens.fx * x / z + lens.cx, lens.fy * y / z + lens.cy])
        by = np.stack(
            [
                lens.fx * (right - (x / z)[:, None] * ahead) / z[:, None],
                lens.fy * (down - (y / z)[:, None] * ahead) / z[:, None],
            ],
            axis=1,
        )
        return pixels, by

    def meet(self, straight: Array, height: float) -> Array | None:
        """Return where straight pixels (n, 2) meet the level plane at a height, (n, 2).

        None: one of them looks at or above the horizon.
        """
        lens = self.lens
        slopes = (straight - (lens.cx, lens.cy)) / (lens.fx, lens.fy)
        ways = np.column_stack([slopes, np.ones(len(slopes))]) @ self.turn
        away = height - self.eye[2]
        if (ways[:, 2] * away <= 0).any():
            return None
        met: Array = self.eye[:2] + ways[:, :2] * (away / ways[:, 2])[:, None]
        return met

"""Target: the pose that an arm's tool should reach, and its distance from that."""

from dataclasses import dataclass
from math import pi

import numpy as np

from rems_net.kinematics.pose import Pose
from rems_net.kinematics.rotation import (
    Array,
    Nine,
    Three,
    cross,
    nine,
    rotation_vector,
)
from rems_net.maths import atan2

#: m. A radian counts as this much: a tool of 0.1 m that is turned by one radian has
#: about this error at its end.
RADIAN = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """Position and rotation that the tool should reach.

    position: (3,) m      rotation: (3, 3), or None for any
    rolls: whether any turn about the tool's own z axis will do
    """

    position: Array
    rotation: Array | None = None
    rolls: bool = False

    def error(self, place: Three, rotation: Nine) -> Array:
        """Return the error, (3,) or (6,): m, and rad times `RADIAN`."""
        missing: Array = self.position - np.array(place)
        if self.rotation is None:
            return missing
        return np.concatenate((missing, RADIAN * self._turn(rotation)))

    def rows(self, jacobian: Array, rotation: Nine) -> Array:
        """Return the error's decrease per joint, from the tool's Jacobian (6, n)."""
        if self.rotation is None:
            return jacobian[:3]
        turns = RADIAN * jacobian[3:]
        if self.rolls:
            z = np.array(rotation[2::3])
            turns = turns - np.outer(z, z @ turns)
        return np.concatenate((jacobian[:3], turns))

    def miss(self, place: Three, rotation: Nine) -> float:
        """Return the distance to the target, m; a radian counts as `RADIAN`."""
        error = self.error(place, rotation)
        return float(np.sqrt(error @ error))

    def apart(self, pose: Pose) -> tuple[float, float]:
        """Return the distance, m, and the angle, rad, between a pose and the target."""
        away = self.position - pose.position
        turn = np.zeros(3)
        if self.rotation is not None:
            turn = self._turn(nine(pose.rotation))
        return float(np.sqrt(away @ away)), float(np.sqrt(turn @ turn))

    def _turn(self, rotation: Nine) -> Array:
        """Return the turn to the target, (3,) rad, in the robot's frame."""
        assert self.rotation is not None  # callers have checked
        if not self.rolls:
            now = np.array(rotation).reshape(3, 3)
            return rotation_vector(self.rotation @ now.T)
        z, goal = rotation[2::3], self.rotation[:, 2]
        across = np.array(cross(z, goal.tolist()))
        sine, cosine = float(np.sqrt(across @ across)), float(np.dot(z, goal))
        if sine < 1e-12 and cosine < 0:  # half a turn, about any axis at right angles
            return pi * np.array(rotation[0::3])
        scale = atan2(sine, cosine) / sine if sine > 1e-12 else 1.0
        turn: Array = across * scale
        return turn

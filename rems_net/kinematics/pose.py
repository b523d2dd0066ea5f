"""Pose: position and rotation of a frame, seen from another frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from rems_net.errors import FieldValueError
from rems_net.kinematics.rotation import (
    Array,
    Nine,
    about,
    added,
    nine,
    product,
    three,
    transposed,
    turned,
)
from rems_net.maths import atan2, hypot, sincos

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
#: largest deviation of a matrix from a rotation, as by rounding
ROUNDING = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Position and rotation of a frame.

    position: (3,) m      rotation: (3, 3), its columns are the frame's axes

    `a @ b`: if b is a pose seen from frame a, this is b seen from a's outer frame.
    Raises FieldValueError for a wrong position or rotation.
    """

    position: Array
    rotation: Array

    def __post_init__(self) -> None:
        position = _numbers(self.position, (3,), "position", "(0.3, 0, 0.2), in m")
        rotation = _numbers(self.rotation, (3, 3), "rotation", "numpy.eye(3)")
        square = rotation @ rotation.T
        if np.abs(square - np.eye(3)).max() > ROUNDING or np.linalg.det(rotation) < 0:
            raise FieldValueError(
                f"The rotation of a pose is {rotation.tolist()}; expected columns of "
                "length 1, at right angles, right-handed. Pose.of(roll=, pitch=, yaw=) "
                "makes one. (R0220)"
            )
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "rotation", rotation)

    @classmethod
    def of(
        cls,
        position: Sequence[float] | Array = (0.0, 0.0, 0.0),
        *,
        roll: float = 0.0,
        pitch: float = 0.0,
        yaw: float = 0.0,
    ) -> Self:
        """Return a pose by angles in rad: roll about x, then pitch about y, then yaw.

        The axes do not turn meanwhile: the convention of ROS and of URDF.
        """
        turns = product(
            about(Z, *sincos(float(yaw))),
            product(about(Y, *sincos(float(pitch))), about(X, *sincos(float(roll)))),
        )
        return cls.at(position, turns)

    @classmethod
    def at(cls, position: Sequence[Any] | Array, rotation: Nine) -> Self:
        """Return the pose of three numbers (m) and nine (a rotation, row by row)."""
        return cls(np.array(position, float), np.array(rotation, float).reshape(3, 3))

    def __matmul__(self, other: "Pose") -> "Pose":
        turn = nine(self.rotation)
        place = added(three(self.position), turned(turn, three(other.position)))
        return Pose.at(place, product(turn, nine(other.rotation)))

    def inverse(self) -> "Pose":
        """Return the pose of the outer frame, seen from this one."""
        back = transposed(nine(self.rotation))
        return Pose.at(turned(back, three(-self.position)), back)

    @property
    def matrix(self) -> Array:
        """The homogeneous transformation, (4, 4)."""
        whole = np.eye(4)
        whole[:3, :3], whole[:3, 3] = self.rotation, self.position
        return whole

    @property
    def rpy(self) -> tuple[float, float, float]:
        """Roll, pitch and yaw, rad, as `of` takes them; pitch from -pi/2 to pi/2."""
        r = self.rotation
        across = hypot(float(r[0, 0]), float(r[1, 0]))
        pitch = atan2(-float(r[2, 0]), across)
        if across < 1e-9:  # roll and yaw have the same axis: take all as yaw
            return 0.0, pitch, atan2(-float(r[0, 1]), float(r[1, 1]))
        roll = atan2(float(r[2, 1]), float(r[2, 2]))
        return roll, pitch, atan2(float(r[1, 0]), float(r[0, 0]))

    def told(self) -> dict[str, float]:
        """Return the pose as plain numbers: x, y, z in m; roll, pitch, yaw in rad."""
        numbers = (*self.position.tolist(), *self.rpy)
        return dict(zip(("x", "y", "z", "roll", "pitch", "yaw"), numbers, strict=True))

    def __str__(self) -> str:
        # Adding 0.0 turns -0.0 into 0.0.
        place = ", ".join(f"{x:.3f}" for x in self.position.round(3) + 0.0)
        turns = ", ".join(f"{x:.1f}" for x in np.degrees(self.rpy).round(1) + 0.0)
        return f"({place}) m, rpy ({turns}) deg"


def _numbers(given: object, shape: tuple[int, ...], what: str, example: str) -> Array:
    try:
        found = np.array(given, float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != shape or not np.isfinite(found).all():
        raise FieldValueError(
            f"The {what} of a pose is {' '.join(repr(given).split()):.80}; expected "
            f"finite numbers of shape {shape}, such as {example}. (R0220)"
        )
    found.setflags(write=False)
    return found

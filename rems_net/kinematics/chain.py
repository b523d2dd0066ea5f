"""Chain: joints one after another, from a base to a tool."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from rems_net.errors import SchemaError
from rems_net.kinematics.arm import Arm
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.rotation import (
    Array,
    Nine,
    Three,
    Vector,
    about,
    added,
    cross,
    nine,
    product,
    three,
    turned,
)
from rems_net.maths import hypot, sincos


@dataclass(frozen=True, slots=True)
class ChainJoint:
    """A joint that moves one link on the link before.

    name: path of its position in the state, and of the target in the command
    at: its position on the link before, m      axis: unit vector
    low, high: its stops, rad; m if it slides
    slides: whether it moves along its axis, not about it

    While all joints are at zero, all frames are parallel to that of the base.
    """

    name: str
    at: Vector
    axis: Vector
    low: float = -inf
    high: float = inf
    slides: bool = False

    def __post_init__(self) -> None:
        x, y, z = self.axis
        if abs(hypot(hypot(x, y), z) - 1) > 1e-6:
            raise SchemaError(
                f"The axis of {self.name!r} is {self.axis}; expected a unit vector, "
                "such as (0, 0, 1). (R0215)"
            )
        if not self.low < self.high:
            raise SchemaError(
                f"The stops of {self.name!r} are {self.low} and {self.high}; expected "
                "the lower one first. (R0215)"
            )


class Chain(Arm):
    """A serial arm: each joint is on the link of the joint before.

    base: pose of the first link's frame, in the robot's frame
    tool: pose of the tool, in the last link's frame
    """

    def __init__(
        self,
        joints: Sequence[ChainJoint],
        *,
        base: Pose | None = None,
        tool: Pose | None = None,
    ):
        super().__init__([j.name for j in joints], [(j.low, j.high) for j in joints])
        self.links = tuple(joints)
        self.base, self.tool = base or Pose.of(), tool or Pose.of()
        self._base = three(self.base.position), nine(self.base.rotation)
        self._tool = three(self.tool.position), nine(self.tool.rotation)

    @property
    def foot(self) -> tuple[float, float]:
        """Point where the first axis, which is upright, meets the ground, m."""
        first = self.base.position + self.base.rotation @ np.array(self.links[0].at)
        return float(first[0]), float(first[1])

    def frames(self, q: Sequence[Any]) -> Iterator[tuple[Three, Three, Nine]]:
        """Yield each joint's position, axis and link's rotation; last, the tool's."""
        place, rotation = self._base
        for joint, angle in zip(self.links, q, strict=True):
            place = added(place, turned(rotation, joint.at))
            axis = turned(rotation, joint.axis)
            if joint.slides:
                x, y, z = axis
                place = added(place, (x * angle, y * angle, z * angle))
            else:
                rotation = product(rotation, about(joint.axis, *sincos(angle)))
            yield place, axis, rotation
        at, last = self._tool
        place, rotation = added(place, turned(rotation, at)), product(rotation, last)
        yield place, turned(rotation, (0.0, 0.0, 1.0)), rotation

    def tip(self, q: Sequence[Any]) -> tuple[Three, Nine]:
        """Return the tool's position and rotation; for arrays of joints, arrays."""
        place, _, rotation = [*self.frames(q)][-1]
        return place, rotation

    def jacobian(self, q: Sequence[float]) -> Array:
        """Return the tool's motion per joint, (6, n): m and rad, per rad (or per m)."""
        *frames, (tip, _, _) = self.frames([float(angle) for angle in q])
        columns = []
        for joint, (place, axis, _) in zip(self.links, frames, strict=True):
            if joint.slides:
                columns.append((*axis, 0.0, 0.0, 0.0))
            else:
                away = (tip[0] - place[0], tip[1] - place[1], tip[2] - place[2])
                columns.append((*cross(axis, away), *axis))
        return np.array(columns).T

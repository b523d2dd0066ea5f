"""Conversion between poses of Webots' models and x, y, heading of a definition.

A rotation is a matrix (3, 3), model to world. The world is ENU: x and y lie flat, z is
up. Webots reports a node's position and orientation in the world. The fields
`translation` and `rotation` of a node are relative to its parent, which has no scale:
around a robot Webots resets it to 1 (Webots' Reference Manual: Supervisor, Transform).
"""

from typing import Any

import numpy as np

from rems_net.bodies.devices import Devices
from rems_net.bodies.parts import Array
from rems_net.bodies.tree import rotation as turned_about
from rems_net.errors import AgentError
from rems_net.kinematics.rotation import rotation_vector
from rems_net.maths import atan2, sincos

#: Rotations (3, 3) from a world of Webots, by its `coordinateSystem`, to ours, where x
#: is east, y north and z up. The letters are the meanings of Webots' x, y and z.
SYSTEMS = {
    "ENU": np.eye(3),
    "NUE": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
}
#: Digits after the point of m and rad that are written. Later digits differ between
#: runs, since each computes the parent's pose from the robot's present pose.
DIGITS = 12


def heading(rotation: Array, devices: Devices) -> float:
    """Return the heading, rad, -pi to pi."""
    ahead = rotation @ np.array(devices.ahead)
    return float(atan2(float(ahead[1]), float(ahead[0])))


def origin(position: Array, rotation: Array, devices: Devices) -> Array:
    """Return the position of the definition's origin in the world (3,), m."""
    at: Array = position + rotation @ np.array(devices.origin)
    return at


def placed(
    x: float, y: float, turned: float, height: float, upright: Array, devices: Devices
) -> tuple[Array, Array]:
    """Return position and rotation of a model with its origin at x, y, and a heading.

    height: of the origin above the floor, m      upright: a rotation while it stands
    """
    sine, cosine = sincos(turned - heading(upright, devices))
    about_z = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    rotation = about_z @ upright
    return np.array([x, y, height]) - rotation @ np.array(devices.origin), rotation


def axis_angle(rotation: Array) -> list[float]:
    """Return a rotation in the format of Webots: an axis of length 1, and rad."""
    vector = rotation_vector(rotation)
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return [0.0, 0.0, 1.0, 0.0]
    return [*(float(part) / angle for part in vector), angle]


def coordinate_system(key: str, robot: Any) -> str:
    """Return the key in SYSTEMS of a Supervisor's world. Raises AgentError for others.

    key: of the agent, for the message
    """
    system = "ENU"  # Webots' default
    nodes = robot.getRoot().getField("children")
    for index in range(nodes.getCount()):
        node = nodes.getMFNode(index)
        if node.getTypeName() == "WorldInfo":
            system = str(node.getField("coordinateSystem").getSFString())
    if system not in SYSTEMS:
        raise AgentError(
            key,
            f"the world's coordinateSystem is {system!r}; expected "
            f'{" or ".join(SYSTEMS)}. Set it to "ENU" in WorldInfo. (R0315)',
        )
    return system


class Placement:
    """The pose of a node of Webots.

    Positions are in m, rotations (3, 3) lead from the model to the world. The world is
    ENU here, even if it is another one in Webots. The parent's pose is computed once,
    when no change of the node's fields is pending.
    """

    def __init__(self, node: Any, system: str):
        self._node, self._world = node, SYSTEMS[system]
        self._translation = node.getField("translation")
        self._rotation = node.getField("rotation")
        *axis, angle = self._rotation.getSFRotation()
        position, rotation = self.read()
        self._turned = rotation @ turned_about((axis[0], axis[1], axis[2]), angle).T
        self._at = position - self._turned @ np.array(self._translation.getSFVec3f())

    def read(self) -> tuple[Array, Array]:
        """Return the node's position (3,) and rotation in the world."""
        rotation = np.array(self._node.getOrientation(), dtype=float).reshape(3, 3)
        position = np.array(self._node.getPosition(), dtype=float)
        return self._world @ position, self._world @ rotation

    def write(self, position: Array, rotation: Array) -> None:
        """Put the node at this pose, at rest, from the next step on."""
        inside = self._turned.T
        translation = inside @ (position - self._at)
        turned = axis_angle(inside @ rotation)
        self._translation.setSFVec3f([round(part, DIGITS) for part in translation])
        self._rotation.setSFRotation([round(part, DIGITS) for part in turned])
        self._node.resetPhysics()

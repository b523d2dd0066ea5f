"""Bounds: the box around a shape, for outlines and for standing on the floor."""

from collections.abc import Mapping
from math import sqrt
from pathlib import Path

import numpy as np

from rems_net.bodies.files.elements import Words
from rems_net.bodies.files.meshes import corners
from rems_net.bodies.files.sheet import Box
from rems_net.bodies.parts import Array
from rems_net.kinematics.pose import Pose


def of_box(pose: Pose, size: Array) -> Box:
    """Return the box around a turned box; size: full edges (3,), m."""
    return pose.position, np.abs(pose.rotation) @ size


def of_ball(pose: Pose, radius: float) -> Box:
    """Return the box around a ball."""
    return pose.position, np.full(3, 2 * radius)


def of_cylinder(pose: Pose, radius: float, length: float) -> Box:
    """Return the box around a cylinder about the pose's z."""
    along = pose.rotation[:, 2]
    across = np.array([sqrt(max(0.0, 1.0 - float(one) ** 2)) for one in along])
    return pose.position, np.abs(along) * length + 2 * radius * across


def of_points(pose: Pose, points: Array) -> Box:
    """Return the box around points (n, 3)."""
    turned = points @ pose.rotation.T + pose.position
    low, high = turned.min(axis=0), turned.max(axis=0)
    return (low + high) / 2, high - low


def of_shape(words: Words, kind: str, told: Mapping[str, str], at: Pose) -> Box | None:
    """Return the box around a shape of a URDF; None for a mesh that we cannot read.

    told: its attributes      Raises SchemaError for a wrong shape or mesh.
    """

    def numbers(key: str, example: str) -> list[float]:
        return words.read(kind, key, told.get(key, ""), example)

    match kind:
        case "box":
            return of_box(at, np.array(numbers("size", "1 1 1")))
        case "sphere":
            return of_ball(at, numbers("radius", "1")[0])
        case "cylinder" | "capsule":
            (radius,), (length,) = numbers("radius", "1"), numbers("length", "1")
            ends = 2 * radius if kind == "capsule" else 0.0
            return of_cylinder(at, radius, length + ends)
        case "mesh":
            scale = words.read(kind, "scale", told.get("scale", "1 1 1"), "1 1 1")
            points = corners(Path(told["filename"]))
            return None if points is None else of_points(at, points * scale)
    raise words.error(
        f"a shape of it is a {kind}; expected a box, a cylinder, a sphere or a mesh"
    )

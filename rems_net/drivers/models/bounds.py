"""Bounds: the box around a shape, for outlines and for standing on the floor."""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import sqrt
from pathlib import Path

import numpy as np

from rems_net.drivers.models.sheet import Box
from rems_net.drivers.models.words import Words
from rems_net.kinematics.pose import Pose
from rems_net.worlds.parts import Array

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("own", "<u2")])


def of_box(pose: Pose, size: Array) -> Box:
    """Return the box around a box that is turned; size: full edges (3,)."""
    return pose.position, np.abs(pose.rotation) @ size


def of_ball(pose: Pose, radius: float) -> Box:
    """Return the box around a ball."""
    return pose.position, np.full(3, 2 * radius)


def of_cylinder(pose: Pose, radius: float, length: float) -> Box:
    """Return the box around a cylinder about the pose's z."""
    along = pose.rotation[:, 2]
    across = np.array([sqrt(max(0.0, 1.0 - float(one) ** 2)) for one in along])
    return pose.position, np.abs(along) * length + 2 * radius * across


def of_shape(words: Words, kind: str, told: Mapping[str, str], at: Pose) -> Box | None:
    """Return the box around a shape of a URDF; None of a mesh that is not read here.

    told: its attributes      Raises SchemaError for what is no shape.
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
            return of_mesh(at, Path(told["filename"]), np.array(scale))
    raise words.error(
        f"a shape of it is a {kind}; expected a box, a cylinder, a sphere or a mesh"
    )


def of_mesh(pose: Pose, path: Path, scale: Array) -> Box | None:
    """Return the box around a mesh; None of a format that is not read here."""
    points = _points(path)
    if points is None or not len(points):
        return None
    turned = (points * scale) @ pose.rotation.T + pose.position
    low, high = turned.min(axis=0), turned.max(axis=0)
    return (low + high) / 2, high - low


def _points(path: Path) -> Array | None:
    """Return the corners (n, 3) of an STL or an OBJ, m before it is scaled."""
    data, kind = path.read_bytes(), path.suffix.lower()
    if kind == ".stl":
        count = int.from_bytes(data[80:84], "little")
        if len(data) == 84 + count * _TRIANGLE.itemsize:
            triangles = np.frombuffer(data, _TRIANGLE, count, 84)
            return triangles["corners"].reshape(-1, 3).astype(float)
        pattern = rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)"
    elif kind == ".obj":
        pattern = rb"(?m)^v\s+(\S+)\s+(\S+)\s+(\S+)"
    else:
        return None
    found = [[float(one) for one in corner] for corner in re.findall(pattern, data)]
    return np.array(found).reshape(-1, 3)

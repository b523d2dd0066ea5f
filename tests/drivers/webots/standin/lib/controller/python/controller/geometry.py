"""Poses as Webots' nodes have them: matrices (4, 4), and fields of a Transform."""

from math import atan2, cos, sin
from typing import Any

import numpy as np

Vector = list[float]
Matrix = Any


def transform(translation: Vector, rotation: Vector) -> Matrix:
    """Return the matrix (4, 4) of a Transform's fields, by Rodrigues' formula."""
    axis, angle = np.array(rotation[:3]), rotation[3]
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += sin(angle) * cross + (1 - cos(angle)) * cross @ cross
    matrix[:3, 3] = translation
    return matrix


def fields(matrix: Matrix) -> tuple[Vector, Vector]:
    """Return translation and rotation; the axis is what the matrix leaves alone."""
    turn = matrix[:3, :3]
    axis = np.linalg.svd(turn - np.eye(3))[2][2]
    across = np.cross(axis, np.eye(3)[np.argmin(abs(axis))])
    angle = atan2(axis @ np.cross(across, turn @ across), across @ (turn @ across))
    return matrix[:3, 3].tolist(), [*axis.tolist(), angle]


def times(matrix: list[Vector], vector: Vector) -> Vector:
    return [sum(a * b for a, b in zip(row, vector, strict=True)) for row in matrix]

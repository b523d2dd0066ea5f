"""Poses: the laws of rotations, and what is none."""

from math import pi
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rems_net.errors import FieldValueError
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.rotation import Array, about, rotation_vector
from rems_net.maths import sincos

angles = st.floats(-pi, pi)
places = st.tuples(*[st.floats(-10, 10)] * 3)
poses = st.builds(
    lambda at, r, p, y: Pose.of(at, roll=r, pitch=p, yaw=y),
    places,
    angles,
    angles,
    angles,
)


def same(a: Pose, b: Pose) -> bool:
    return np.allclose(a.matrix, b.matrix, atol=1e-9)


@given(poses, poses, poses)
def test_poses_are_a_group(a: Pose, b: Pose, c: Pose) -> None:
    assert same((a @ b) @ c, a @ (b @ c))
    assert same(a @ a.inverse(), Pose.of())
    assert np.allclose((a @ b).matrix, a.matrix @ b.matrix)


@given(poses)
def test_angles_read_back(pose: Pose) -> None:
    roll, pitch, yaw = pose.rpy
    assert abs(pitch) <= pi / 2
    assert same(Pose.of(pose.position, roll=roll, pitch=pitch, yaw=yaw), pose)


def test_angles_are_those_of_ros() -> None:
    # Nose up is a negative pitch; a yaw of a quarter turn looks to the left.
    assert Pose.of(pitch=-0.1).rotation[2, 0] > 0
    assert Pose.of(yaw=pi / 2).rotation[:, 0] == pytest.approx([0, 1, 0], abs=1e-12)
    straight_down = Pose.of(pitch=pi / 2, yaw=0.3)
    assert straight_down.rpy == pytest.approx((0.0, pi / 2, 0.3))


axes = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


@given(axes, st.floats(1e-9, pi))
def test_a_rotation_vector_is_axis_times_angle(
    axis: tuple[float, float, float], angle: float
) -> None:
    x, y, z = (np.array(axis) / np.linalg.norm(axis)).tolist()
    turned: Array = np.array(about((x, y, z), *sincos(angle))).reshape(3, 3)
    found = rotation_vector(turned)
    wanted = np.array([x, y, z]) * angle
    if angle > pi - 1e-7:  # half a turn to either side is the same
        found = found * np.sign(found @ wanted)
    assert found == pytest.approx(wanted, abs=1e-7)


@pytest.mark.parametrize(
    ("position", "rotation", "said"),
    [
        ((1, 2), np.eye(3), "position of a pose is .* such as"),
        ((1, 2, "x"), np.eye(3), "expected finite numbers"),
        ((1, 2, 3), np.eye(4), "rotation of a pose is .* such as numpy.eye"),
        ((1, 2, 3), 2 * np.eye(3), "right angles, right-handed"),
        ((1, 2, 3), np.diag([1.0, 1.0, -1.0]), "right-handed"),
    ],
)
def test_what_is_no_pose_is_refused(position: Any, rotation: Any, said: str) -> None:
    with pytest.raises(FieldValueError, match=said):
        Pose(position, rotation)


def test_it_prints_what_a_person_reads() -> None:
    pose = Pose.of((0.1, -0.25, 0.3), yaw=pi / 2)
    assert str(pose) == "(0.100, -0.250, 0.300) m, rpy (0.0, 0.0, 90.0) deg"

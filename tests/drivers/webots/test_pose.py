"""Where a model of Webots is, whichever way its frame lies."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rems_net.bodies.devices import Devices
from rems_net.bodies.parts import Array
from rems_net.drivers.webots import pose
from rems_net.kinematics.rotation import wrapped

#: x ahead, y up, z to the right, as the class's Woodbot lies
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
angles = st.floats(-np.pi, np.pi)


def rotation(axis: Array, angle: float) -> Array:
    """Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    parts: list[Array] = [np.eye(3), np.sin(angle) * cross]
    return sum(parts, (1 - np.cos(angle)) * cross @ cross)


@given(st.tuples(*[st.floats(-1, 1)] * 3), angles)
def test_axis_and_angle_are_the_rotation(
    axis: tuple[float, float, float], angle: float
) -> None:
    vector = np.array(axis)
    if np.linalg.norm(vector) < 1e-3:
        vector = np.array([0.0, 0.0, 1.0])
    matrix = rotation(vector / np.linalg.norm(vector), angle)
    *found, turn = pose.axis_angle(matrix)
    assert np.linalg.norm(found) == pytest.approx(1)
    assert rotation(np.array(found), turn) == pytest.approx(matrix, abs=1e-9)


@pytest.mark.parametrize("upright", [np.eye(3), Y_UP], ids=["z up", "y up"])
@given(x=st.floats(-9, 9), y=st.floats(-9, 9), turned=angles)
def test_what_is_placed_is_there(
    upright: Array, x: float, y: float, turned: float
) -> None:
    devices = Devices((), origin=(-0.014, -0.006, 0.002))
    position, matrix = pose.placed(x, y, turned, 0.02, upright, devices)
    assert pose.origin(position, matrix, devices) == pytest.approx([x, y, 0.02])
    off = wrapped(pose.heading(matrix, devices) - turned)
    assert off == pytest.approx(0, abs=1e-9)
    # It still stands: what was up is up.
    up = upright.T @ [0, 0, 1]
    assert matrix @ up == pytest.approx([0, 0, 1], abs=1e-9)

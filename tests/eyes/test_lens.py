"""Lenses, views and the middle of a pixel."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from rems_net.bodies.body import Marker
from rems_net.bodies.lens import Lens
from rems_net.errors import SchemaError
from rems_net.eyes.place import angles, place_of
from rems_net.eyes.plane import corners, sight
from rems_net.eyes.view import View, turn_of
from rems_net.kinematics.rotation import wrapped

SMALL = st.floats(-0.3, 0.3)


@given(SMALL, SMALL, st.floats(-0.01, 0.01), st.floats(-0.01, 0.01))
def test_distortion_is_undone(k1: float, k2: float, p1: float, p2: float) -> None:
    lens = Lens(640, 480, 500.0, 510.0, 330.0, 230.0, (k1, k2 / 3, p1, p2, 0.0))
    slopes = np.random.default_rng(1).uniform(-0.4, 0.4, (30, 2))
    there = lens.straighten(lens.bend(slopes))
    assert np.abs(there - slopes).max() < 1e-6


def test_the_middle_of_the_upper_left_pixel_is_at_0_0() -> None:
    lens = Lens.seeing(640, 480, 1.0)
    left, right, bottom, top = lens.edges()
    assert (left, bottom) == (-right, -top)
    ((u, v),) = lens.pixels(np.array([[left, -top, 1.0]]))
    assert (u, v) == pytest.approx((-0.5, -0.5))
    ((u, v),) = lens.pixels(np.array([[0.0, 0.0, 1.0]]))
    assert (u, v) == (319.5, 239.5)


@given(
    *(st.floats(-0.2, 0.2) for _ in "xy"),
    st.floats(-pi, pi),
    st.floats(-pi, pi),
    st.floats(-1.57, -0.6),
    st.floats(-0.5, 0.5),
)
def test_a_pose_comes_back_from_its_corners(
    x: float, y: float, heading: float, view: float, pitch: float, roll: float
) -> None:
    turn = turn_of(view, pitch, roll)
    lens = Lens(640, 480, 500.0, 510.0, 330.0, 230.0, (-0.2, 0.05, 0.001, 0.0, 0.0))
    ahead = turn[:, 0]
    looking = View.at(lens, np.array([0, 0, 0.05]) - 0.8 * ahead, turn)
    marker = Marker("tag36h11", 1, 0.04, (0.03, -0.02, 0.0), 0.4)
    s, c = np.sin(heading), np.cos(heading)
    flat = corners(marker) @ np.array([[c, s], [-s, c]]) + (x, y)
    points = np.column_stack([flat, np.full(4, 0.05)])
    pixels = lens.pixels((points - looking.eye) @ looking.turn.T)
    found = sight(looking, marker, 0.05, pixels)
    assert found is not None
    assert found.pose[:2] == pytest.approx([x, y], abs=1e-6)
    assert wrapped(found.pose[2] - heading) == pytest.approx(0.0, abs=1e-5)
    assert found.scale == pytest.approx(1.0, abs=1e-5)


def test_above_the_horizon_there_is_no_pose() -> None:
    level = View.at(Lens.seeing(640, 480, 1.0), np.array([0, 0, 1.0]), np.eye(3))
    high = np.array([(300, 100), (340, 100), (340, 60), (300, 60)], float)
    assert sight(level, Marker("tag36h11", 1, 0.04), 0.0, high) is None


@given(st.floats(-3.1, 3.1), st.floats(-1.4, -0.5), st.floats(-0.4, 0.4))
# Its reflection in the plane has the same pixels.
@example(2.1875, -1.375, 0.0)
def test_a_camera_is_where_known_points_say(
    heading: float, pitch: float, roll: float
) -> None:
    turn = turn_of(heading, pitch, roll)
    eye = np.array([0.1, -0.2, 0.0]) - 1.1 * turn[:, 0]
    view = View.at(Lens.seeing(640, 480, 1.0), eye, turn)
    middle = np.array([0.1, -0.2])
    flat = middle + np.random.default_rng(3).uniform(-0.2, 0.2, (16, 2))
    points = np.column_stack([flat, np.zeros(16)])
    pixels, _ = view.project(points)
    elsewhere = View.at(view.lens, np.array([0, 0, 1.0]), turn_of(0, -1.5, 0))
    found, left = place_of(elsewhere, points, pixels)
    assert left < 1e-6
    assert found.eye == pytest.approx(eye, abs=1e-6)
    assert angles(found.turn) == pytest.approx((heading, pitch, roll), abs=1e-6)


def test_impossible_lenses_are_refused() -> None:
    with pytest.raises(SchemaError, match=r"fx and fy above 0.*R1101"):
        Lens(640, 480, 0.0, 500.0, 320.0, 240.0)
    with pytest.raises(SchemaError, match=r"near 319.5, 239.5; got cx, cy = 900"):
        Lens(640, 480, 500.0, 500.0, 900.0, 240.0)
    with pytest.raises(SchemaError, match=r"markers 0 to 34; got id = 40.*R1102"):
        Marker("tag25h9", 40, 0.04)
    with pytest.raises(SchemaError, match=r"such as \"40 mm\"; got 0 m.*R1102"):
        Marker("tag36h11", 1, 0.0)

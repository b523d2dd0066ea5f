"""Bodies: masses and inertias add up, walls make a circle."""

from math import cos, hypot, pi, sin, sqrt

import numpy as np
import pytest

from rems_net.bodies.body import Arena, Box, Cylinder, Part, Sphere, lump
from rems_net.errors import SchemaError


def test_inertia_of_the_textbook_shapes() -> None:
    box = lump([Part(Box((1, 2, 3)), 12.0)]).inertia
    assert box == pytest.approx(np.diag([13.0, 10.0, 5.0]))
    ball = lump([Part(Sphere(0.5), 10.0)]).inertia
    assert ball == pytest.approx(np.eye(3))
    rod = lump([Part(Cylinder(1.0, 3.0, axis=(0, 1, 0)), 2.0)]).inertia
    assert rod == pytest.approx(np.diag([2.0, 1.0, 2.0]))


def test_a_tilted_cylinder_is_a_turned_cylinder() -> None:
    diagonal = (sqrt(0.5), 0.0, sqrt(0.5))
    upright = lump([Part(Cylinder(0.1, 1.0), 1.0)]).inertia
    tilted = lump([Part(Cylinder(0.1, 1.0, axis=diagonal), 1.0)]).inertia
    c = s = sqrt(0.5)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    assert tilted == pytest.approx(turn @ upright @ turn.T)


def test_two_halves_are_one_box() -> None:
    half = Box((1.0, 1.0, 1.0))
    halves = lump([Part(half, 1.0, (0.5, 2, 0)), Part(half, 1.0, (1.5, 2, 0))])
    whole = lump([Part(Box((2.0, 1.0, 1.0)), 2.0, (1.0, 2.0, 0.0))])
    assert halves.mass == whole.mass
    assert halves.centre == pytest.approx(whole.centre)
    assert halves.inertia == pytest.approx(whole.inertia)


def test_what_weighs_nothing_is_refused() -> None:
    with pytest.raises(SchemaError, match="needs a mass"):
        lump([Part(Sphere(1.0), 0.0)])


def test_axes_have_length_1() -> None:
    with pytest.raises(SchemaError, match=r"length 1.*got \(0, 2, 0\)"):
        Cylinder(0.1, 0.2, axis=(0, 2, 0))


def test_the_round_wall_touches_its_circle_and_has_no_gaps() -> None:
    walls = Arena(0.4).walls()
    faces = []
    for wall in walls:
        thick, length, height = wall.size
        assert wall.at[2] - height / 2 == 0.0
        inner = hypot(*wall.at[:2]) - thick / 2
        assert inner == pytest.approx(0.4)
        faces.append((inner * cos(wall.yaw), inner * sin(wall.yaw), length))
    step = 2 * pi / len(walls)
    assert faces[0][2] / 2 >= 0.4 * np.tan(step / 2)
    assert 0.4 / cos(step / 2) - 0.4 < 0.0005
    assert Arena().walls() == []

"""Rays without an engine see what MuJoCo's see; outlines say who is in one place."""

from importlib import import_module
from math import cos, hypot, inf, pi, sin, sqrt
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rems_net.bodies.arena import Wall
from rems_net.bodies.body import Body, Box, Cylinder, Part, Sphere
from rems_net.robots.woodbot import Woodbot
from rems_net.scenes import outline, rays
from rems_net.scenes.scene import Scene, Solid, Thing
from tests.drivers.physics.test_physics import needs

TILTED = (sqrt(0.5), 0.0, sqrt(0.5))
THINGS = (
    Thing("box", Box((0.2, 0.3, 0.1)), (0.4, 0.1, 0.05), heading=0.4),
    Thing("ramp", Box((0.4, 0.2, 0.01)), (-0.4, 0.2, 0.05), heading=2.0, pitch=0.3),
    Thing("ball", Sphere(0.1), (0.1, -0.5, 0.1)),
    Thing("can", Cylinder(0.05, 0.3), (-0.3, -0.3, 0.15), heading=1.0),
    Thing("log", Cylinder(0.05, 0.4, axis=TILTED), (0.5, 0.5, 0.2)),
)
SCENE = Scene((Wall((0.01, 1.0, 0.2), (-0.8, 0.0, 0.1), 0.3),), THINGS)


@needs("mujoco")
def test_they_see_what_mujoco_sees() -> None:
    mujoco: Any = import_module("mujoco")

    from rems_net.drivers.physics.scenery import mjcf

    body = Body((Part(Sphere(0.01), 1.0, (0, 0, 50.0)),))
    model = mujoco.MjModel.from_xml_string(mjcf([body], SCENE))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    solids, random, seen = SCENE.solids, Random(1), 0
    for _ in range(600):
        start = np.array([random.uniform(-1, 1), random.uniform(-1, 1), 0.0])
        start[2] = random.uniform(0.02, 0.6)
        turn, up = random.uniform(-pi, pi), random.uniform(-1.0, 0.6)
        direction = np.array([cos(turn) * cos(up), sin(turn) * cos(up), sin(up)])
        hit = np.zeros(1, np.int32)
        theirs = mujoco.mj_ray(model, data, start, direction, None, 1, -1, hit)
        ours = rays.distance(start, direction, solids)
        if theirs < 0:
            assert ours == inf
            continue
        inside = any(_holds(solid, start) for solid in solids)
        if not inside:  # from within, MuJoCo sees where the ray comes out
            seen += hit[0] > 0
            assert ours == pytest.approx(theirs, abs=1e-9)
    assert seen > 40


def _holds(solid: Solid, point: np.ndarray) -> bool:
    x, y, z = solid.turn.T @ (point - solid.at)
    match solid.shape:
        case Box((a, b, c)):
            return bool(abs(x) < a / 2 and abs(y) < b / 2 and abs(z) < c / 2)
        case Sphere(radius):
            return bool(x * x + y * y + z * z < radius * radius)
        case Cylinder(radius, length, axis):
            along = np.dot((x, y, z), axis)
            across = x * x + y * y + z * z - along * along
            return bool(abs(along) < length / 2 and across < radius * radius)


numbers = st.floats(-0.3, 0.3)


@given(numbers, numbers, st.floats(-pi, pi), numbers, numbers, st.floats(-pi, pi))
def test_who_is_in_one_place(
    x: float, y: float, turn: float, u: float, v: float, other: float
) -> None:
    """Both say the same of each other; discs by their distance, to a corner's width."""
    box = outline.of_body(Body((Part(Box((0.1, 0.06, 0.1)), 1.0),), height=0.05))
    mine, yours = box.at((x, y, turn)), box.at((u, v, other))
    assert mine.meets(yours) == yours.meets(mine)
    assert mine.meets(mine)
    disc = outline.of_body(Body((Part(Cylinder(0.1, 0.1), 1.0),), height=0.05))
    apart = hypot(x - u, y - v)
    if apart < 0.19:
        assert disc.at((x, y, turn)).meets(disc.at((u, v, other)))
    elif apart > 0.2001:
        assert not disc.at((x, y, turn)).meets(disc.at((u, v, other)))


def test_what_is_above_is_not_in_the_way() -> None:
    low = outline.of_body(Body((Part(Box((1, 1, 0.1)), 1.0),), height=0.05))
    bridge = Thing("bridge", Box((1, 1, 0.1)), (0, 0, 0.5))
    assert not low.meets(outline.of_solid(bridge.solid))


def test_a_woodbots_outline() -> None:
    body = Woodbot("w").body()
    found = outline.of_body(body)
    low, high = found.corners.min(axis=0), found.corners.max(axis=0)
    assert high[0] == pytest.approx(0.02, abs=1e-3)  # its wheels
    assert low[0] == pytest.approx(-0.07575, abs=1e-6)  # its board
    assert high[1] == pytest.approx(0.1126 / 2 + 0.0015)
    assert found.low == pytest.approx(0.0, abs=5e-4)

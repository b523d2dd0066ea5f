"""Plates with markers under a camera, where the truth about their poses is known."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import pi, radians, tan
from typing import Any, NamedTuple

import numpy as np
import pytest

from rems_net.bodies.body import Body, Box, Marker, Part
from rems_net.bodies.parts import Array
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pictures.optics import Chip, distorted, ideal
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.eyes.finder import Finder, Target
from rems_net.eyes.view import View, turn_of
from rems_net.kinematics.rotation import wrapped
from rems_net.robots.eyes.camera import Camera
from rems_net.scenes.scene import Scene
from tests.drivers.physics.eyes import Engine, why_not

#: m. Upper sides of the plates, markers on them, and the width that a picture shows.
HEIGHT, WIDTH = 0.0605, 0.9
CHIP = {"blur": 0.7, "grain": 6.0}
OVER = {
    **{"width": 640, "height": 480, "field_of_view": radians(60), **CHIP},
    "place": {"z": HEIGHT + WIDTH / 2 / tan(radians(30))},
}
SIDE = {
    **{"width": 1280, "height": 720, "field_of_view": radians(60), **CHIP},
    "place": {"x": -0.75, "z": 0.75, "pitch": "-45 deg"},
}


class Run(NamedTuple):
    """Errors (n, 3) of poses, m and rad; NEES of each; and how many were missed."""

    errors: Array
    nees: Array
    missed: int
    doubts: list[tuple[str, int, str]]

    @property
    def off(self) -> tuple[float, float]:
        """Root mean square of the distance, mm, and of the heading, degrees."""
        square = (self.errors**2).mean(axis=0)
        return float(1e3 * np.sqrt(square[0] + square[1])), float(
            np.degrees(np.sqrt(square[2]))
        )


class Plates:
    """An engine's world of plates, each with a marker of its number, and a camera."""

    def __init__(self, engine: Engine, camera: Mapping[str, Any], family: str, n: int):
        eye = Camera("cam", parameters=camera)
        place = eye.parameters["place"]
        self.turn = turn_of(place["heading"], place["pitch"], place["roll"])
        self.at = np.array([place["x"], place["y"], place["z"]])
        self.view = View.at(eye.lens(), self.at, self.turn)
        (self.camera,) = eye.body().sensors
        self.chip = Chip(self.camera, "plates")  # type: ignore[arg-type]
        on = (0.0, 0.0, HEIGHT - 0.05)
        self.markers = [Marker(family, i, 0.04, on) for i in range(n)]
        plate = (Part(Box((0.06, 0.06, 0.02)), 1.0),)
        bodies = [Body(plate, height=0.05, markers=(one,)) for one in self.markers]
        build: Any = engine.build  # type: ignore[attr-defined]
        self.engine = build(None, [eye.body(), *bodies], Scene())
        self.poses = np.array([[100.0 * (i + 1), 0.0, 0.0] for i in range(n)])
        targets = {one.id: Target(str(one.id), one, HEIGHT) for one in self.markers}
        self.finder = Finder(self.view, targets)

    def put(self, poses: Array) -> None:
        """Move the plates to these poses (n, 3)."""
        for i, pose in enumerate(poses):
            x, y, heading = pose - self.poses[i]
            self.engine.instances[i + 1].move((x, y, 0.0), heading)
        self.poses = np.array(poses)
        self.engine.refresh()

    def shoot(self) -> Any:
        """Return what the camera sees."""
        camera: Any = self.camera
        draw = self.engine.instances[0].picture
        drawn = draw(ideal(camera), self.at, self.turn[:, 0], self.turn[:, 2])
        return self.chip.take(distorted(camera)(drawn))

    def grey(self) -> Any:
        """Return what the camera sees, without colours."""
        return np.ascontiguousarray(self.shoot()[:, :, 1])


@contextmanager
def plates(
    engine: Engine, camera: Mapping[str, Any], family: str = "tag36h11", n: int = 6
) -> Iterator[Plates]:
    """Give plates under a camera; skip the test where this engine draws nothing."""
    if why := why_not(engine):
        pytest.skip(why)
    made = Plates(engine, camera, family, n)
    try:
        yield made
    finally:
        made.engine.close()


def scattered(random: np.random.Generator, n: int, reach: tuple[float, float]) -> Array:
    """Return n poses that keep 10 cm between each other, within this reach."""
    spots: list[Array] = []
    while len(spots) < n:
        spot = random.uniform(-1, 1, 2) * reach
        if all(np.hypot(*(spot - other)) > 0.1 for other in spots):
            spots.append(spot)
    return np.column_stack([np.array(spots), random.uniform(-pi, pi, n)])


def measured(made: Plates, pictures: int, reach: tuple[float, float]) -> Run:
    """Compare the found poses with the truth, in pictures of scattered plates.

    The first picture does not count: 4x4 markers count from their second one on.
    """
    random = np.random.default_rng(5)
    errors, nees, doubts = [], [], []
    n = len(made.markers)
    for picture in range(pictures + 1):
        made.put(scattered(random, n, reach))
        found, new = made.finder.look(made.grey())
        doubts += new
        if not picture:
            continue
        for one in found:
            error = one.pose - made.poses[one.target.marker.id]
            error[2] = wrapped(error[2])
            errors.append(error)
            nees.append(error @ np.linalg.solve(one.covariance, error))
    missed = pictures * n - len(errors)
    return Run(np.array(errors), np.array(nees), missed, doubts)


ENGINES: dict[str, Engine] = {"mujoco": Mujoco, "pybullet": Pybullet}

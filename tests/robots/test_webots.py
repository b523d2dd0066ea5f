"""How far the Woodbot's three implementations are from the class's Webots."""

from typing import Any

import numpy as np
import pytest

from rems_net.agents.robot import Driver
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from tests.robots.figures import CLASS, FINE, webots_distance
from tests.robots.lab import recording
from tests.robots.webots import RECORDING, distance_from_webots


def test_the_class_model_is_29_mm_away() -> None:
    found = webots_distance(Kinematic, parameters=CLASS, options=FINE)
    assert found == pytest.approx(0.0291, abs=5e-4)


@pytest.mark.parametrize(
    ("driver", "library", "options"),
    [
        (Kinematic, "numpy", FINE),
        (Mujoco, "mujoco", {}),
        (Pybullet, "pybullet", {}),
    ],
)
def test_the_woodbots_own_constants_come_within_10_mm(
    driver: type[Driver], library: str, options: dict[str, Any]
) -> None:
    pytest.importorskip(library, reason=f"{library} is not installed.")
    assert webots_distance(driver, options=options) < 0.010


def test_webots_is_nowhere_from_itself_wherever_it_is_laid() -> None:
    rows = recording(RECORDING)
    heading = np.array([row["state.th_z"] for row in rows])
    x = np.array([row["state.x"] for row in rows]) - 0.01425 * np.cos(heading)
    y = np.array([row["state.y"] for row in rows]) - 0.01425 * np.sin(heading)
    assert distance_from_webots(x, y, heading, rows) < 1e-12
    c, s = np.cos(0.7), np.sin(0.7)
    moved = c * x - s * y + 3.0, s * x + c * y - 1.0
    assert distance_from_webots(*moved, heading + 0.7, rows) < 1e-12


def test_each_row_needs_a_point() -> None:
    rows = recording(RECORDING)
    with pytest.raises(ValueError, match="101 rows of Webots need as many"):
        distance_from_webots([0.0], [0.0], [0.0], rows)

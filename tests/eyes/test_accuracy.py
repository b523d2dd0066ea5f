"""How near the found poses are to the truth, and whether their covariance is honest."""

from __future__ import annotations

import numpy as np
import pytest

from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from tests.eyes.arena import ENGINES, OVER, SIDE, measured, plates

#: m. Where markers are wholly in the picture: half its height, and half its width.
REACH = (0.28, 0.38)
#: m. The same from the side, at 45 degrees.
ASIDE = (0.25, 0.25)


def test_from_above_poses_are_exact_and_honest() -> None:
    """The requirement is 0.4 mm and 0.4 degrees; measured, 0.03 mm and 0.06."""
    with plates(Mujoco, OVER) as made:
        run = measured(made, 20, REACH)
    distance, angle = run.off
    assert run.missed == 0
    assert distance < 0.1
    assert angle < 0.15
    assert 0.6 < run.nees.mean() / 3 < 1.5  # of 120 poses only
    assert run.doubts == []
    assert 0.01 < made.finder.deviation < 0.05  # measured in the pictures, px


def test_from_the_side() -> None:
    with plates(Mujoco, SIDE) as made:
        run = measured(made, 6, ASIDE)
    assert run.missed == 0
    assert run.off[0] < 0.3
    assert run.off[1] < 0.3


def test_with_arucos() -> None:
    pytest.importorskip("cv2")
    with plates(Mujoco, OVER, "aruco4x4") as made:
        run = measured(made, 10, REACH)
    assert run.missed == 0
    assert run.off[0] < 0.8
    assert run.off[1] < 1.5
    assert run.doubts == []


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("family", ["tag36h11", "aruco4x4"])
@pytest.mark.parametrize("camera", ["above", "aside"])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_thousand_poses(engine: str, camera: str, family: str) -> None:
    """From aside 98 % are asked for; two of 1020 4x4 markers are missed there."""
    where, reach = {"above": (OVER, REACH), "aside": (SIDE, ASIDE)}[camera]
    most = (0.1, 0.15)
    if family == "aruco4x4":
        pytest.importorskip("cv2")
        most = (0.8, 1.5)
    with plates(ENGINES[engine], where, family) as made:
        run = measured(made, 170, reach)
    print(engine, camera, family, run.off, run.missed, run.nees.mean() / 3)
    assert run.missed <= (0 if camera == "above" else 5)
    assert run.off[0] < most[0]
    assert run.off[1] < most[1]
    # In Bullet's pictures from aside the stated deviations are 15 % too large.
    least = 0.65 if (engine, camera) == ("pybullet", "aside") else 0.8
    assert least < run.nees.mean() / 3 < 1.25


def test_by_bullet_pixels_have_their_middle_at_the_same_place() -> None:
    """Half a pixel is 0.7 mm here."""
    with plates(Pybullet, OVER) as made:
        run = measured(made, 2, REACH)
    assert run.missed == 0
    assert run.off[0] < 0.1
    assert np.abs(run.errors[:, :2].mean(axis=0)).max() < 1e-4


def test_a_bent_lens_changes_little() -> None:
    bent = {**OVER, "bends": [-0.25, 0.08, 0.001, -0.001, 0.0]}
    with plates(Mujoco, bent) as made:
        run = measured(made, 3, REACH)
    assert run.missed == 0
    assert run.off[0] < 0.3
    assert run.off[1] < 0.3

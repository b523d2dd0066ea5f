"""A physics engine as predictor: mass, friction, motors, planted and found."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from rems_net import Woodbot
from rems_net.errors import ExperimentError
from rems_net.identification.drive import Drive
from rems_net.identification.fit import Fit, fit
from rems_net.identification.identify import identify
from rems_net.identification.simulated import Simulated
from tests.identification.test_identify import FIVE, NOISE, keys

pytest.importorskip("mujoco")

OPEN = {"arena_radius": 0}
#: A heavy robot with weak motors, so that its mass shows.
HEAVY = {**OPEN, "mass": 1.0, "wheel_torque": "0.01 N*m"}


def planted(
    base: Mapping[str, Any], true: Mapping[str, float], noise: float
) -> tuple[Simulated, Drive]:
    """Return a predictor, and a drive of 10 s in MuJoCo with these parameters."""
    random, rows = np.random.default_rng(1), 100
    predictor = Simulated(Woodbot, base, "mujoco")
    state = {path: np.zeros(rows + 1) for path in ("x", "y", "heading")}
    command = {
        path: np.r_[0.0, keys(random, rows)] for path in ("wheel/left", "wheel/right")
    }
    time = 0.1 * np.arange(rows + 1, dtype=np.float64)
    way = predictor._simulate(Drive("plan", time, command, state), true)
    read = way + noise * NOISE[:, None] * random.standard_normal(way.shape)
    return predictor, Drive(
        "planted", time, command, dict(zip(state, read, strict=True))
    )


def holds(found: Fit, true: Mapping[str, float]) -> None:
    for name, value in true.items():
        assert abs(found.values[name] - value) <= found.half[name]


def test_a_drive_that_is_gone_is_not_taken_for_another() -> None:
    """As those with a turned sign, which only one check predicts."""
    predictor, time = Simulated(Woodbot, OPEN, "mujoco"), 0.1 * np.arange(6.0)
    state = {path: np.zeros(6) for path in ("x", "y", "heading")}
    for share in (1.0, -1.0, 1.0):
        command = {path: np.full(6, share) for path in ("wheel/left", "wheel/right")}
        way = predictor._way(Drive("one", time, command, state), {})
        assert way[0, -1] * share > 0.01


@pytest.mark.slow  # 60 simulations of 10 s
@pytest.mark.timeout(900)
def test_mass_and_friction_are_found() -> None:
    true = {"mass": 1.3, "tail_friction": 0.25}
    predictor, drive = planted(HEAVY, true, 0.2)
    ranges = {"mass": (0.03, 10.0), "tail_friction": (0.0, 5.0)}
    found = fit(predictor, [drive], {"mass": 1.0, "tail_friction": 0.1}, ranges)
    holds(found, true)
    assert found.half["mass"] < 0.3
    assert found.half["tail_friction"] < 0.1


@pytest.mark.slow  # 100 simulations of 10 s
@pytest.mark.timeout(900)
def test_five_parameters_take_at_most_a_minute() -> None:
    true = {name: float(np.mean(span)) for name, (_, _, span) in FIVE.items()}
    predictor, drive = planted(OPEN, true, 1.0)
    begin = {name: one[0] for name, one in FIVE.items()}
    began = time.process_time()
    found = fit(predictor, [drive], begin, {name: one[1] for name, one in FIVE.items()})
    assert time.process_time() - began <= 60.0
    holds(found, true)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ({"names": []}, "name some: --fit mass,track"),
        ({"names": ["mass"], "suggest": True}, "leave out --suggest"),
        ({"names": ["mass"], "driver": "kinematic"}, "does not simulate a body"),
    ],
)
def test_what_a_simulation_cannot_do_is_said(
    words: dict[str, Any], sentence: str
) -> None:
    random = np.random.default_rng(2)
    state = {path: np.zeros(50) for path in ("x", "y", "heading")}
    command = {path: keys(random, 50) for path in ("wheel/left", "wheel/right")}
    drive = Drive("plan", 0.1 * np.arange(50.0), command, state)
    with pytest.raises(ExperimentError, match=sentence):
        identify([drive], Woodbot, parameters=OPEN, **{"driver": "mujoco", **words})

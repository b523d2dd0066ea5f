"""Hardware of another hand: what identification makes of a robot that is no model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from rems_net import Woodbot
from rems_net.identification.drive import Drive
from rems_net.identification.identify import identify
from rems_net.identification.prediction import Predictor, cut
from tests.identification.standin import run

#: The stand-in's runs that are identified, and those that are only predicted.
SEEN, UNSEEN = range(4), range(4, 10)
OPEN = {"arena_radius": 0}


def astray(
    drives: Sequence[Drive], values: Mapping[str, float], seconds: float
) -> float:
    """Return the RMS distance [m] of free runs of so many seconds from the readings."""
    segments = cut(drives, seconds)
    found = Predictor(Woodbot, OPEN)(segments, segments.starts(), values)
    off = (found - np.array([*segments.read.values()]))[:2] * segments.weight
    return float(np.sqrt((off**2).sum() / segments.weight.sum()))


def test_six_runs_are_predicted_from_four_others() -> None:
    found = identify([run(seed) for seed in SEEN], Woodbot, parameters=OPEN)
    values = {one.name: one.value for one in found.parameters if one.adopted}
    others = [run(seed) for seed in UNSEEN]
    assert astray(others, values, 10.0) <= 0.007 < astray(others, {}, 10.0) / 5
    assert astray(others, values, 1.0) <= 0.0012 < astray(others, {}, 1.0) / 5
    assert values["actuation/lag"] == pytest.approx(0.09, rel=0.1)
    assert values["actuation/delay"] == pytest.approx(0.06, rel=0.1)
    assert values["actuation/dead_band"] == pytest.approx(0.05, rel=0.1)
    assert values["actuation/gain/wheel/right"] == pytest.approx(0.93, rel=0.1)

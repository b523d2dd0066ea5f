"""Bad input of an identification: it is named, and nothing is fitted to it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rems_net
from rems_net import Woodbot
from rems_net.errors import ExperimentError
from rems_net.identification.drive import Drive
from rems_net.identification.identify import identify
from tests.identification.test_identify import driven, fitted, keys

OPEN = {"arena_radius": 0}
TRUE = {"track": 0.1, "max_wheel_speed": 7.0}


def drive(seed: int, rows: int = 200, stands: slice = slice(0)) -> Drive:
    random = np.random.default_rng(seed)
    left, right = keys(random, rows), keys(random, rows)
    left[stands], right[stands] = 1.0, 0.5
    return driven(TRUE, left, right, random, stands)


def described(one: Drive) -> str:
    text = str(identify([one], Woodbot, parameters=OPEN, names=[*TRUE]))
    return " ".join(text.split())  # as if no line ended


def true(one: Drive) -> None:
    found = fitted(one, TRUE)
    for name, value in TRUE.items():
        assert found.values[name] == pytest.approx(value, rel=0.03)


def test_a_segment_at_a_wall_is_left_out() -> None:
    stuck = drive(1, stands=slice(106, 124))
    true(stuck)
    text = described(stuck)
    assert "segments do not fit and are left out (from 10" in text
    assert "it stood while it was commanded to go: a wall" in text


def test_a_lifted_robot_costs_the_segments_in_which_it_is_lifted() -> None:
    """Somebody carries it elsewhere, while its wheels turn."""
    lifted = drive(2, stands=slice(64, 82))
    for path in ("x", "y"):
        lifted.state[path][82:] += 0.2
    true(lifted)
    assert "or somebody has lifted it" in described(lifted)


@pytest.mark.parametrize("pace", [0.99, 1.01])
def test_clocks_that_drift_are_named(pace: float) -> None:
    one = drive(3, rows=400)
    late = {p: np.interp(one.time * pace, one.time, c) for p, c in one.state.items()}
    words = "slower" if pace > 1 else "faster"
    with pytest.raises(ExperimentError, match=f"{words} than that of the commands"):
        described(replace(one, state=late))


def test_a_constant_delay_is_no_drift() -> None:
    random = np.random.default_rng(4)
    slow = {"actuation/lag": 0.09, "actuation/delay": 0.08}
    one = driven(TRUE | slow, keys(random, 400), keys(random, 400), random)
    found = identify([one], Woodbot, parameters=OPEN | TRUE, names=[*slow])
    assert set(found.adopted()) == {*slow}


@pytest.mark.parametrize("side", ["wheel/left", "wheel/right"])
def test_a_motor_that_turns_the_other_way_is_named(side: str) -> None:
    one = drive(5)
    turned = replace(one, command={**one.command, side: -one.command[side]})
    with pytest.raises(ExperimentError, match=f"obeys '{side}' goes the other way"):
        described(turned)


def test_a_heading_that_turns_the_other_way_is_named() -> None:
    one = drive(6)
    mirrored = {**one.state, "heading": -one.state["heading"], "y": -one.state["y"]}
    with pytest.raises(ExperimentError, match="'heading' turns the other way"):
        described(replace(one, state=mirrored))


def test_a_value_that_is_no_number_is_named(tmp_path: Path) -> None:
    one = drive(7, rows=50)
    columns = {"time [s]": one.time}
    columns |= {f"command/{p} [percent]": 100 * v for p, v in one.command.items()}
    units = {"x": "m", "y": "m", "heading": "rad"}
    columns |= {f"state/{p} [{units[p]}]": v.copy() for p, v in one.state.items()}
    columns["state/x [m]"][17] = np.nan
    rows = np.array([*columns.values()]).T.tolist()
    lines = [",".join(columns), *(",".join(map(str, row)) for row in rows)]
    (tmp_path / "robot.csv").write_text("\n".join(lines), encoding="utf-8")
    recording = rems_net.read(tmp_path)
    with pytest.raises(ExperimentError, match="expected a number, but got 'nan'"):
        rems_net.identify(recording, definition=Woodbot)

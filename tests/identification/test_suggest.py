"""The drive that is suggested shows more than a random drive of its length."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import rems_net
from rems_net import Experiment
from rems_net.cli import main
from rems_net.identification.drive import Drive, Floats
from rems_net.identification.fit import Fit, fit
from rems_net.identification.suggest import Suggestion, suggest
from tests.identification.test_identify import FIVE, PREDICTOR, driven, keys

RANGES = {name: span for name, (_, span, _) in FIVE.items()}
#: Rows of a suggested drive.
ROWS = 200


def known(seed: int) -> tuple[dict[str, float], Drive, Fit, np.random.Generator]:
    """Return planted parameters, a first drive, and what it shows of them."""
    random = np.random.default_rng(seed)
    true = {name: random.uniform(*span) for name, (_, _, span) in FIVE.items()}
    first = driven(true, keys(random, 100), keys(random, 100), random)
    begin = {name: one[0] for name, one in FIVE.items()}
    return true, first, fit(PREDICTOR, [first], begin, RANGES), random


def anything(random: np.random.Generator, rows: int) -> Floats:
    """Return random shares of full speed, each held for 0.4 to 1 s."""
    shares: list[float] = []
    while len(shares) < rows:
        shares += [float(random.uniform(-1, 1))] * int(random.integers(4, 11))
    return np.array(shares[:rows])


def suggested(seed: int) -> list[Suggestion]:
    """Return the drives that are suggested after a first one."""
    _, first, found, _ = known(seed)
    return suggest(PREDICTOR, [first], found.values, RANGES, found.error)


@pytest.fixture(scope="module")
def after_straight() -> list[Suggestion]:
    """The drives that are suggested after a straight one; the robot is that of 2001."""
    random = np.random.default_rng(1)
    true, _, found, _ = known(2001)
    ahead = keys(random, 100)
    straight = driven(true, ahead, ahead, random)
    return suggest(PREDICTOR, [straight], found.values, RANGES, found.error)


def narrow(seed: int, best: Suggestion) -> list[float]:
    """Return how much narrower intervals are than after two other drives (logarithms).

    The others are as of a person with keys, and random shares.
    """
    true, _, found, random = known(seed)
    left, right = (
        best.drive.command[f"wheel/{side}"][1:] for side in ("left", "right")
    )
    others = [(one(random, ROWS), one(random, ROWS)) for one in (keys, anything)]
    widths = []
    for sides in ((left, right), *others):
        drive = driven(true, *sides, random)
        half = fit(PREDICTOR, [drive], found.values, RANGES).half
        widths.append(float(np.log([*half.values()]).mean()))
    return [width - widths[0] for width in widths[1:]]


def test_what_is_suggested_is_narrower(after_straight: list[Suggestion]) -> None:
    """Of the next test's robots, one that the person does not drive well."""
    assert min(narrow(2001, after_straight[0])) > 0.1


@pytest.mark.slow  # 20 suggestions, and 80 fits
@pytest.mark.timeout(3000)
def test_what_is_suggested_is_narrower_in_18_of_20_cases() -> None:
    cases = np.array([narrow(seed, suggested(seed)[0]) for seed in range(2000, 2020)])
    person, chance = (cases > 0).sum(axis=0)
    assert chance >= 18
    # A person drives well: on the average a third wider, less than one drive shows.
    assert person >= 15


def test_twenty_drives_are_compared_and_turns_follow_a_straight_drive(
    after_straight: list[Suggestion],
) -> None:
    assert len({one.name for one in after_straight}) == 20
    gains = [one.gain for one in after_straight]
    assert gains == sorted(gains, reverse=True)
    assert np.ptp(after_straight[0].drive.state["heading"]) > 1.0


def test_an_input_plays_what_is_suggested(tmp_path: Path) -> None:
    lab = Experiment("lab", dt="50 ms", duration="10 s")
    lab.robot("sim", "woodbot", "kinematic")
    with lab.engine(tmp_path / "run") as engine:
        for left, right in ((3, 5), (5, 2), (-2, -4), (4, 4), (5, -5)) * 4:
            engine.put("robot/sim/command", {"wheel": {"left": left, "right": right}})
            engine.step(9)
    file, fields = tmp_path / "next.csv", "track,max_wheel_speed"
    arguments = ["identify", str(tmp_path / "run"), "--suggest", str(file)]
    assert main([*arguments, "--fit", fields, "--set", "track=0.12"]) == 0
    again = Experiment("again", dt="0.1 s", duration="10 s", folder=tmp_path)
    again.input("keys", "csv", options={"file": "next.csv"})
    again.robot("sim", "woodbot", "kinematic", command="input/keys")
    with again.engine(tmp_path / "next") as engine:
        engine.run()
    played = rems_net.read(tmp_path / "next")["sim"]
    assert np.ptp(played.plain("command/wheel/left")) > 7.0

"""Robots that drive on no floor: each field of their states is explained by itself."""

from __future__ import annotations

import numpy as np
import pytest

from rems_net.cli.report import why_lines
from rems_net.recordings.parting.why import Why
from tests.recordings.parting.conftest import ROWS, TIME, Array, Write, drive

#: where a joint is told to go, rad
AIM = np.repeat([0.5, -0.4, 0.9, 0.2], ROWS // 4)


def follow(aim: Array, speed: float = 1.0) -> Array:
    """How a joint goes there at this speed, rad/s."""
    where, found = 0.0, []
    for target in aim:
        where += float(np.clip(target - where, -speed * 0.05, speed * 0.05))
        found.append(where)
    return np.array(found)


def arm(joint: Array, other: Array | None = None, aim: Array = AIM) -> dict[str, Array]:
    wrist = np.sin(TIME) if other is None else other
    return {
        "command/joint/1 [rad]": aim,
        "state/joint/1 [rad]": joint,
        "state/joint/2 [rad]": wrist,
    }


ONE = follow(AIM)
PLANTED = {
    "later": (np.interp(TIME - 0.12, TIME, ONE), "later", 0.12, "0.12 s later"),
    "far": (1.2 * ONE, "way", 1.2, "goes 1.2 times as far"),
    "off": (ONE + 0.05, "offset", 0.05, "is +0.05 rad off all the time"),
    "drift": (ONE + 0.02 * TIME, "drift", 0.02, "goes +0.02 rad/s more"),
    "wrong": (-ONE, "way", -1.0, "goes -1 times as far (the wrong sign?)"),
    "degrees": (np.degrees(ONE), "way", 57.3, "times as far (degrees for radians?)"),
    "slips": (ONE - 0.3 * (TIME > 4.9), "jolt", 5.0, "jumps by -0.3 rad at "),
    "slow": (follow(AIM, 0.6), "limit", 0.6, "never goes faster than 0.6 rad/s"),
    "stuck": (np.where(TIME < 4, ONE, ONE[79]), "episode", None, "is held from 4."),
}


@pytest.mark.parametrize("name", PLANTED)
def test_what_is_planted_in_a_joint_is_found(write: Write, name: str) -> None:
    joint, kind, size, says = PLANTED[name]
    found: Why = write(None, a=arm(ONE), b=arm(joint)).why()
    # The joint that differs is told of first; the other one is the same.
    assert [one.field for one in found.partings] == ["state/joint/1", "state/joint/2"]
    assert found.causes[0].kind == kind, found
    assert found.causes[-1].share > 0.95
    assert says in found.line
    if size is not None:
        assert found.causes[0].numbers[0] == pytest.approx(size, rel=0.02)
    assert "joint/2: the same (rms 0 rad)" in repr(found)


def test_one_that_all_but_stands_is_told_of(write: Write) -> None:
    """By numbers so small that their squares are nothing: as an engine holds it."""
    found: Why = write(None, a=arm(1e-200 * ONE), b=arm(ONE * 0)).why()
    assert "joint/1: the same" in repr(found)
    found = write(None, a=arm(1e-200 * ONE), b=arm(ONE * 0 + 0.3)).why()
    assert "joint/1" in found.line


@pytest.mark.parametrize(
    ("off", "agree"), [(5e-6, True), (9e-5, True), (2e-4, False), (0.01, False)]
)
def test_little_that_nobody_cares_for_is_agreement(
    write: Write, off: float, agree: bool
) -> None:
    found: Why = write(None, a=arm(ONE), b=arm(ONE + off)).why()
    assert (found.line == f"they agree (rms {off:.2g} rad)") is agree
    assert bool(found.causes) is not agree


def test_what_is_little_of_little_is_explained(write: Write) -> None:
    """A joint that goes a hundredth of a degree all in all."""
    small = 1e-4 * ONE
    found: Why = write(None, a=arm(small), b=arm(1.5 * small)).why()
    assert found.line.startswith("100 %  joint/1 goes 1.5 times as far")


def test_of_several_the_one_that_is_furthest_off_is_first(write: Write) -> None:
    found = write(None, a=arm(ONE), b=arm(ONE + 0.01, 2 * np.sin(TIME))).why()
    assert [one.field for one in found.partings] == ["state/joint/2", "state/joint/1"]
    assert found.line == "100 %  joint/2 goes 2 times as far (a diameter for a radius?)"


def test_another_aim(write: Write) -> None:
    """A command that says where to go, and not how fast."""
    aim = AIM.copy()
    aim[120:] = 0.6
    found = write(None, a=arm(ONE), b=arm(follow(aim), aim=aim)).why()
    assert found.causes[0].kind == "told"
    assert found.causes[0].share > 0.8
    assert "does not receive the same commands from 6.05 s on: " in found.line
    assert "s on: joint/1 0.6, not 0.2 rad" in found.line


def test_one_that_misses_its_aim(write: Write) -> None:
    """As one that swings past it."""
    swings = ONE + 0.3 * np.exp(-(((TIME - 1.0) / 0.3) ** 2))
    found = write(None, a=arm(ONE), b=arm(swings)).why()
    assert found.causes[0].kind == "episode"
    assert "up to 0.3 rad off its target when a is there" in found.line


def test_one_that_runs_away_is_compared_until_then(write: Write) -> None:
    """By numbers whose squares are beyond floats, as of a step that is too long."""
    away = ONE + np.where(TIME > 4.0, 1e200, 0.2)
    recording = write(None, a=arm(ONE), b=arm(away))
    found = recording.why()
    assert found.causes[0].kind == "offset"
    assert found.line.endswith("; then state/joint/1 of b is 1e+200 rad at 4.05 s")
    assert {len(one.time) for one in recording.compare()} == {80, 160}
    recording = write(None, a=arm(ONE), b=arm(away + 1e60))
    said = " ".join(why_lines(recording, recording.differences(())))
    assert "compared from the first step on: state/joint/1 of b is" in said


def test_one_that_starts_far_away(write: Write) -> None:
    """From a metre on it is told in metres."""
    still = np.zeros((160, 2))
    one, other = drive(still, np.zeros(3)), drive(still, np.array([1.0, 0.0, 0.0]))
    start = {"a": np.zeros(3), "b": np.array([1.0, 0.0, 0.0])}
    assert write(start, a=one, b=other).why().line == "100 %  starts 1 m away"

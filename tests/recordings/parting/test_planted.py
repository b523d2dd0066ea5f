"""A cause that was planted is found, with its size; where there is none, none is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings, strategies as st

from rems_net.recordings.parting.why import Why
from rems_net.recordings.recording import read
from tests.recordings.parting.conftest import (
    DT,
    POSE,
    ROWS,
    TIME,
    TOLD,
    Array,
    Write,
    drive,
    late,
    told,
)

few = settings(
    max_examples=6,
    phases=(Phase.generate,),
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
seeds = st.integers(0, 10**6)
signs = st.sampled_from((-1.0, 1.0))
places = st.tuples(*[st.floats(-2, 2)] * 3).map(np.array)
#: factors that are none of 1
factors = st.floats(0.6, 0.97) | st.floats(1.03, 1.5)


def only(found: Why, share: float = 0.98) -> tuple[str, tuple[float, ...]]:
    """The one cause that is told, which leaves nothing to be explained."""
    assert len(found.causes) == 1, found
    (cause,) = found.causes
    assert cause.share > share, found
    assert cause.look
    assert all(len(line) <= 80 for line in repr(found).splitlines()), found
    return cause.kind, cause.numbers


@few
@given(seed=seeds, place=places, known=st.booleans())
def test_equal_runs_have_no_cause(
    write: Write, seed: int, place: Array, known: bool
) -> None:
    one = drive(told(seed), place)
    start = {"a": place, "b": place} if known else None
    found = write(start, a=one, b=one).why()
    assert (found.line, list(found.causes)) == ("the same", [])
    assert repr(found) == "a - b: the same (rms 0 m)"


@few
@given(
    seed=seeds,
    place=places,
    by=factors,
    part=st.sampled_from(("way", "turn", "all")),
    known=st.booleans(),
)
def test_a_scale(
    write: Write, seed: int, place: Array, by: float, part: str, known: bool
) -> None:
    """A radius, a track, a unit; with and without word of the start."""
    command = told(seed)
    size = {"way": (by, 1.0), "turn": (1.0, by), "all": (by, by)}[part]
    one = drive(command, place)
    other = drive(command, place, lambda steps, _: steps * size)
    start = {"a": place, "b": place} if known else None
    # Without that, the first step belongs to nobody.
    kind, numbers = only(write(start, a=one, b=other).why(), 0.98 if known else 0.9)
    assert kind == part
    assert numbers == pytest.approx([by], rel=2e-3 if known else 0.03)


@few
@given(seed=seeds, place=places, by=st.floats(0.02, 0.4), known=st.booleans())
def test_later(write: Write, seed: int, place: Array, by: float, known: bool) -> None:
    one = drive(told(seed), place)
    other = late(one, by, place)
    start = {"a": place, "b": place} if known else None
    recording = write(start, a=one, b=other)
    kind, numbers = only(recording.why("a", "b"), 0.95)
    assert kind == "later"
    assert numbers == pytest.approx([by], abs=0.004)
    first = recording.why("b", "a").causes[0]  # what b did last of all is unknown
    assert first.kind == "later"
    assert first.numbers == pytest.approx([-by], abs=0.03)


@few
@given(
    seed=seeds,
    place=places,
    off=st.tuples(st.floats(0.2, 1), st.floats(-1, 1), st.floats(-1, 1)),
    known=st.booleans(),
)
def test_elsewhere(
    write: Write, seed: int, place: Array, off: tuple[float, ...], known: bool
) -> None:
    command, there = told(seed), place + off
    start = {"a": place, "b": there} if known else None
    one, other = drive(command, place), drive(command, there)
    assert only(write(start, a=one, b=other).why())[0] == "start"


@few
@given(seed=seeds, place=places, begin=st.integers(0, ROWS // 2), more=signs)
def test_told_otherwise(
    write: Write, seed: int, place: Array, begin: int, more: float
) -> None:
    command = told(seed)
    other = command.copy()
    other[begin : begin + 40] += (0.1 * more, 0.3)
    start = {"a": place, "b": place}
    found = write(start, a=drive(command, place), b=drive(other, place)).why()
    assert only(found)[0] == "told"
    assert f"from {TIME[begin]:.2f} s on" in found.line


@few
@given(seed=seeds, place=places, begin=st.integers(20, ROWS // 2))
def test_stopped(write: Write, seed: int, place: Array, begin: int) -> None:
    """One got its safe command from some time on: late, held back, or STOP."""
    command = told(seed)
    assume(np.abs(command[begin : begin + 5]).min() > 0)
    other = command.copy()
    other[begin:] = 0
    start = {"a": place, "b": place}
    found = write(start, a=drive(command, place), b=drive(other, place)).why()
    assert only(found)[0] == "told"
    since = f"from {TIME[begin]:.2f} s"
    assert f"is commanded to stand while a is not, {since}" in found.line


@few
@given(seed=seeds, place=places, rate=st.floats(0.02, 0.3), sign=signs)
def test_a_heading_that_drifts(
    write: Write, seed: int, place: Array, rate: float, sign: float
) -> None:
    command, start = told(seed), {"a": place, "b": place}
    one = drive(command, place)
    other = drive(command, place, lambda s, _: s + np.array([0, sign * rate * DT]))
    kind, numbers = only(write(start, a=one, b=other).why())
    assert kind == "drift"
    assert numbers == pytest.approx([sign * rate], rel=0.01)


@few
@given(seed=seeds, place=places, by=st.floats(0.2, 2), sign=signs)
def test_a_line_that_bends(
    write: Write, seed: int, place: Array, by: float, sign: float
) -> None:
    command, start = told(seed), {"a": place, "b": place}

    def bend(steps: Array, _: Array) -> Array:
        return steps + steps[:, :1] * (0.0, sign * by)

    one, other = drive(command, place), drive(command, place, bend)
    kind, numbers = only(write(start, a=one, b=other).why())
    assert kind == "bend"
    assert numbers == pytest.approx([sign * by], rel=0.01)


@few
@given(seed=seeds, place=places, speed=st.floats(0.01, 0.1), rate=st.floats(0, 0.2))
def test_creeping(
    write: Write, seed: int, place: Array, speed: float, rate: float
) -> None:
    """It should stand for half of the time, and does not."""
    command, start = told(seed), {"a": place, "b": place}
    command[ROWS // 2 :] = 0

    def creep(steps: Array, _: Array) -> Array:
        still = ~np.asarray(steps.any(axis=1))
        return steps + still[:, None] * (speed * DT, rate * DT)

    one, other = drive(command, place), drive(command, place, creep)
    kind, numbers = only(write(start, a=one, b=other).why())
    assert kind == "creep"
    assert numbers == pytest.approx([speed, 0.0, rate], abs=2e-3)


@few
@given(seed=seeds, place=places, begin=st.integers(10, 100), turn=st.floats(0.1, 0.6))
def test_a_jolt(write: Write, seed: int, place: Array, begin: int, turn: float) -> None:
    command, start = told(seed), {"a": place, "b": place}

    def push(steps: Array, _: Array) -> Array:
        steps[begin] += (0.03, turn)
        return steps

    one, other = drive(command, place), drive(command, place, push)
    kind, numbers = only(write(start, a=one, b=other).why())
    assert kind == "jolt"
    assert numbers[0] == pytest.approx(TIME[begin], abs=0.06)
    assert numbers[-1] == pytest.approx(turn, rel=0.05)


@few
@given(seed=seeds, begin=st.integers(40, 120))
def test_held(write: Write, seed: int, begin: int) -> None:
    """It runs into something, which its bumper notices, and the other one does not."""
    command = told(seed)
    command[:] = (0.2, 0.1 * np.sign(command[0, 1]))
    place = np.zeros(3)

    def hold(steps: Array, _: Array) -> Array:
        steps[begin:] = 0
        return steps

    one, other = drive(command, place), drive(command, place, hold)
    one["sensors/ray [m]"] = np.full(ROWS, 2.0)
    other["sensors/ray [m]"] = np.where(np.arange(ROWS) < begin, 1.0, 0.012)
    found = write({"a": place, "b": place}, a=one, b=other).why()
    assert only(found)[0] == "episode"
    assert "is held from" in found.line
    assert "(b: ray reads 12 mm)" in found.line
    since = float(found.line.split(" from ")[1].split(" s ")[0])
    assert since == pytest.approx(TIME[begin], abs=0.11)


@few
@given(seed=seeds, size=st.floats(0.001, 0.05))
def test_noise(write: Write, seed: int, size: float) -> None:
    place = np.zeros(3)
    one = drive(told(seed), place)
    noise = np.random.default_rng(seed).normal(size=(3, ROWS)) * size
    other = one | {n: one[n] + more for n, more in zip(POSE, noise, strict=True)}
    found = write({"a": place, "b": place}, a=one, b=other).why()
    assert found.causes[0].kind == "noise"


def test_what_nothing_explains_is_said_to_be_so(write: Write) -> None:
    """It weaves about the way of the other one, and nobody told it to."""
    straight = np.tile((0.2, 0.0), (ROWS, 1))
    one = drive(straight, np.zeros(3))
    other = one | {"state/y [m]": 0.05 * np.sin(3 * TIME)}
    found = write(None, a=one, b=other).why()
    assert "nothing tried explains half" in found.line
    assert not found.causes


def test_a_few_rows_tell_nothing(write: Write) -> None:
    one, other = drive(told(1), np.zeros(3)), drive(told(2), np.zeros(3))
    recording = write(None, a=one, b=other)
    for path in recording.files:
        path.write_text("".join(path.read_text().splitlines(keepends=True)[:6]))
    found = read(recording.folder).why()
    assert found.line == "5 rows are too few to find why"
    assert not found.causes


def shape(hand: np.random.Generator) -> Array:
    """One of what is hard to compute with, (ROWS,)."""
    walk = np.cumsum(hand.normal(size=ROWS))
    found: Array = hand.choice(
        [0 * TIME, 0 * TIME + 1, 1e-17 * walk, 1e-150 * walk, walk, 1e6 * TIME]
    )
    return found


@settings(few, max_examples=10)
@given(seed=seeds, started=st.booleans(), same=st.booleans())
def test_whatever_they_do_something_is_said(
    write: Write, seed: int, started: bool, same: bool
) -> None:
    hand = np.random.default_rng(seed)
    names = (*TOLD, *POSE, "state/wheel/left [rad]", "sensors/ray [m]")
    one = {name: shape(hand) for name in names}
    other = {name: one[name] if same else shape(hand) for name in names[:4]}
    other |= {name: shape(hand) for name in names[4:]}
    start = {"a": hand.normal(size=3), "b": np.zeros(3)} if started else None
    found = write(start, a=one, b=other).why()
    assert all(len(line) <= 80 for line in repr(found).splitlines())
    assert "nan" not in repr(found)
    last = [part.causes[-1] for part in found.partings if part.causes]
    assert all(0.5 < cause.share <= 1 + 1e-9 for cause in last)


@few
@given(seed=seeds, place=places, most=st.floats(0.05, 0.12))
def test_a_top_speed(write: Write, seed: int, place: Array, most: float) -> None:
    command, start = told(seed), {"a": place, "b": place}
    fast = np.abs(command[:, 0])
    assume((fast > 1.5 * most).mean() > 0.25)
    assume(np.unique(np.minimum(fast, most)).size > 2)  # else it might be a factor

    def limit(steps: Array, _: Array) -> Array:
        return np.stack((np.clip(steps[:, 0], -most * DT, most * DT), steps[:, 1]), 1)

    one, other = drive(command, place), drive(command, place, limit)
    kind, numbers = only(write(start, a=one, b=other).why())
    assert kind == "limit"
    assert numbers == pytest.approx([most], rel=0.01)

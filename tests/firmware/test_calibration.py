"""A servo that is known, found again from the speeds that its pulses make."""

from collections import Counter
from dataclasses import replace
from random import Random

import pytest
from hypothesis import assume, given, strategies as st

from rems_net.errors import ExperimentError
from rems_net.firmware.calibration import Servo, fit
from rems_net.identification.intervals import student

SHARES = [sign * share for share in (0.2, 0.35, 0.5) for sign in (1, -1)]
TOLD = [7.3 * share for share in SHARES]


@st.composite
def servos(draw: st.DrawFn) -> Servo:
    """A servo as they are sold, mounted either way."""
    return Servo(
        draw(st.floats(-60, 60)),
        draw(st.floats(0, 60)),
        draw(st.floats(4, 10)),
        draw(st.booleans()),
    )


def turns(servo: Servo, pulse: float) -> float:
    """The speed of a servo's wheel ahead [rad/s] at a pulse off the middle [us]."""
    off = (pulse - servo.trim) * (-1 if servo.reversed else 1)
    share = min(max(abs(off) - servo.dead_band, 0) / (500 - servo.dead_band), 1)
    return share * servo.top_speed if off > 0 else -share * servo.top_speed


@given(servos(), servos())
def test_a_servo_is_found_again(true: Servo, believed: Servo) -> None:
    believed = replace(believed, reversed=true.reversed)
    told = [believed.top_speed * share for share in SHARES]
    found = [turns(true, believed.pulse(speed)) for speed in told]
    moves = [speed for speed in found if abs(speed) > 0.2]
    assume(len(moves) >= 3 and min(moves) < 0 < max(moves))
    made, _, _ = fit(believed, told, found)
    assert made.trim == pytest.approx(true.trim, abs=1e-6)
    assert made.dead_band == pytest.approx(true.dead_band, abs=1e-6)
    assert made.top_speed == pytest.approx(true.top_speed)


@pytest.mark.parametrize("mirrored", [False, True])
def test_intervals_hold_the_truth(mirrored: bool) -> None:
    """Of 400 servos with noisy speeds, in 91 to 98 of 100 cases."""
    true = Servo(12.0, 40.0, 6.9, mirrored)
    believed = Servo(0.0, 0.0, 7.3, mirrored)
    told = [believed.top_speed * share for share in SHARES]
    random, held, runs = Random(7), Counter[str](), 400
    for _ in range(runs):
        found = [turns(true, believed.pulse(s)) + random.gauss(0, 0.02) for s in told]
        made, spread, freedom = fit(believed, told, found)
        for name in ("trim", "dead_band", "top_speed"):
            off = abs(getattr(made, name) - getattr(true, name))
            held[name] += off <= student(freedom) * getattr(spread, name)
    assert all(0.91 <= count / runs <= 0.98 for count in held.values()), held


@given(servos())
def test_a_pulse_and_its_speed(servo: Servo) -> None:
    assert servo.pulse(0) == servo.trim
    for share in SHARES:
        speed = share * servo.top_speed
        assert turns(servo, servo.pulse(speed)) == pytest.approx(speed)
    assert turns(servo, servo.pulse(1000)) == pytest.approx(servo.top_speed)


SERVO = Servo(0, 0, 7.3, False)


@pytest.mark.parametrize(
    ("found", "says"),
    [
        ([0.0] * 6, "it does not turn"),
        ([-speed for speed in TOLD], "set its reversed to yes"),
        ([max(speed, 0) for speed in TOLD], "hardly turns in one direction"),
        ([8.0 * (1 if s > 0 else -1) - s for s in TOLD], "does not grow"),
        ([speed / 2 + 5.0 for speed in TOLD], "no servo's"),
    ],
)
def test_what_is_no_servo(found: list[float], says: str) -> None:
    with pytest.raises(ExperimentError, match=says):
        fit(SERVO, TOLD, found)

"""The last hop: whatever is told, and whenever, wheels stand still when they must."""

import math
from typing import Any

import pytest
from hypothesis import given, strategies as st

from rems_net.robots.woodbot import Woodbot
from tests.firmware.safety.bench import (
    MAX_AGE,
    PERIOD,
    PLAIN,
    TOP,
    Bench,
    Servo,
    Why,
    stands,
)


@pytest.mark.parametrize("said", ["nothing", "the same again", "nonsense", "ticks"])
def test_wheels_stand_within_max_age_and_one_period(bench: Bench, said: str) -> None:
    bench.begin()
    assert not stands(bench.drive(5.0, 5.0))
    told = bench.now
    while not stands(bench.step()):
        assert bench.now - told <= MAX_AGE + PERIOD
        bench.wait(PERIOD)
        if said == "the same again":
            bench.tell(5.0, 5.0, told, 1)
        elif said == "nonsense":
            bench.tell(math.nan, 5.0, bench.now, 2)
        if said != "nothing":
            bench.tick()
    limit = PERIOD if said == "nonsense" else MAX_AGE + PERIOD
    assert bench.now - told <= limit


def test_the_clock_falls_silent(bench: Bench) -> None:
    bench.begin()
    for number in range(1, 200):
        bench.wait(PERIOD)
        bench.tell(5.0, 5.0, bench.now, number)
        if number < 100:
            bench.tick()
        reading = bench.step()
        assert stands(reading) == (number > 99 + MAX_AGE // PERIOD)
    assert Why(reading.why) == Why.NO_TICK
    assert reading.expired == 1


def test_stop_is_latched(bench: Bench) -> None:
    bench.begin()
    bench.drive(5.0, 5.0)
    before = bench.now
    bench.stop(Why.STOPPED)
    for number in range(300):
        assert stands(bench.drive(5.0, 5.0, number)), "STOP holds"
        bench.wait(PERIOD)
    bench.wait(10)
    bench.release()
    bench.tick()
    for said in (before, bench.now - 1, bench.now):
        bench.tell(5.0, 5.0, said, 4)
        assert stands(bench.step()), "it was said before the release"
    assert not stands(bench.drive(5.0, 5.0))


def test_a_stop_between_two_steps_is_not_missed(bench: Bench) -> None:
    bench.begin()
    bench.drive(5.0, 5.0)
    bench.stop(Why.LEFT)
    bench.release()
    assert stands(bench.step())


def test_a_late_burst_moves_nothing(bench: Bench) -> None:
    """What was said before it stopped by itself comes after that, and is young."""
    bench.begin()
    bench.drive(5.0, 5.0)
    bench.wait(MAX_AGE + 1)
    assert Why(bench.step().why) == Why.OLD
    stood = bench.now
    bench.wait(PERIOD)
    bench.tick()
    for said in range(stood - 2 * PERIOD, stood + 1, PERIOD):
        bench.tell(5.0, 5.0, said, 2)
        assert stands(bench.step())
    bench.tell(5.0, 5.0, stood + 1, 3)
    assert not stands(bench.step())


def test_what_is_to_come_is_never_obeyed(bench: Bench) -> None:
    bench.begin()
    bench.tell(5.0, 5.0, bench.now + 100_000, 1)
    for _ in range(200):
        bench.wait(PERIOD)
        bench.tick()
        assert stands(bench.step())


def test_without_settings_no_wheel_gets_a_pulse(bench: Bench) -> None:
    bench.start(0)
    reading = bench.drive(5.0, 5.0)
    assert Why(reading.why) == Why.DRIVEN
    assert list(reading.pulses) == [0, 0]
    bench.wait(1_000_000)
    assert bench.step().x == 0, "a wheel that has no pulses does not turn"


def test_the_watchdog_is_fed_at_every_step(bench: Bench) -> None:
    bench.begin()
    for fed in range(1, 50):
        bench.wait(PERIOD)
        assert bench.step().feeds == fed


# -- pulses --------------------------------------------------------------------


def turning(servo: Servo, pulse: int) -> float:
    """The speed of a servo [rad/s] that gets this pulse, ahead of the robot."""
    offset = pulse - 1500 - servo.trim
    beyond = max(0.0, abs(offset) - servo.dead_band) / (500 - servo.dead_band)
    ahead = -1 if servo.reversed else 1
    return ahead * math.copysign(min(1.0, beyond) * servo.top_speed, offset)


SERVOS = st.builds(
    Servo,
    st.floats(-200, 200),
    st.floats(0, 200),
    st.floats(0.1, 50),
    st.booleans(),
)


@given(SERVOS, SERVOS, st.floats(-TOP, TOP), st.floats(-TOP, TOP))
def test_pulses_are_those_of_the_speed(
    bench: Bench, left: Servo, right: Servo, speed: float, other: float
) -> None:
    bench.start(0)
    assert bench.set(left, right)
    reading = bench.drive(speed, other)
    for servo, pulse, told in zip(
        (left, right), reading.pulses, (speed, other), strict=True
    ):
        wanted = max(-servo.top_speed, min(servo.top_speed, told))
        resolution = servo.top_speed / (500 - servo.dead_band)
        assert turning(servo, pulse) == pytest.approx(wanted, abs=resolution)


@given(st.floats(), st.floats(), st.floats(), st.booleans(), st.booleans())
def test_settings_that_no_servo_can_have_change_nothing(
    bench: Bench, trim: float, dead_band: float, top: float, turned: bool, right: bool
) -> None:
    bench.begin()
    before = list(bench.drive(3.0, -3.0).pulses)
    odd = Servo(trim, dead_band, top, turned)
    taken = bench.set(PLAIN[0], odd) if right else bench.set(odd, PLAIN[1])
    possible = abs(trim) <= 500 and 0 <= dead_band <= 250 and 0.01 <= top <= 100
    assert taken == possible
    after = list(bench.drive(3.0, -3.0).pulses)
    assert all(700 <= pulse <= 2300 for pulse in after)
    assert taken or after == before


# -- odometry ------------------------------------------------------------------

PARAMETERS: Any = Woodbot.parameters.schema()


@given(st.floats(-TOP, TOP), st.floats(-TOP, TOP), st.integers(1, 100))
def test_odometry_is_that_of_wheels_that_roll(
    bench: Bench, left: float, right: float, steps: int
) -> None:
    bench.begin()
    begin = bench.drive(left, right)
    for _ in range(steps):
        bench.wait(PERIOD)
        bench.tick()
        bench.tell(left, right, bench.now, 1)
        end = bench.step()
    time = steps * PERIOD * 1e-6
    radius, track = PARAMETERS.wheel_radius, PARAMETERS.track
    way, turn = (
        radius * (left + right) / 2 * time,
        radius * (right - left) / track * time,
    )
    middle, half = begin.heading + turn / 2, turn / 2
    chord = way * (math.sin(half) / half if half else 1.0)
    assert end.heading - begin.heading == pytest.approx(turn, abs=1e-9)
    assert end.x - begin.x == pytest.approx(chord * math.cos(middle), abs=2e-6)
    assert end.y - begin.y == pytest.approx(chord * math.sin(middle), abs=2e-6)


def test_odometry_stands_when_the_wheels_do(bench: Bench) -> None:
    bench.begin()
    bench.drive(5.0, 4.0)
    bench.wait(MAX_AGE + 1)
    moved = bench.step()
    assert moved.x > 0.02, "it went on until it was seen to be too late"
    bench.wait(10 * MAX_AGE)
    still = bench.step()
    assert (still.x, still.y, still.heading) == (moved.x, moved.y, moved.heading)
    bench.reset()
    zero = bench.step()
    assert (zero.x, zero.y, zero.heading) == (0, 0, 0)
    assert zero.since == moved.since, "since then the wheels have stood"

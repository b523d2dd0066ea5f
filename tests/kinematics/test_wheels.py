"""Bases: the sheet's formulas, there and back, and what wheels cannot do."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rems_net.agents.robot import Definition
from rems_net.errors import FieldValueError, UnreachableError
from rems_net.kinematics.wheels import (
    Twist,
    Wheels,
    differential,
    mecanum,
    mecanum_speeds,
    slowed,
)
from rems_net.robots.create2 import Create2
from rems_net.robots.pioneer import Pioneer3AT
from rems_net.robots.woodbot import Woodbot

NAMES = ("fl", "fr", "rl", "rr")
R, BASE, TRACK = 0.05, 0.456, 0.316
FOUR = mecanum(NAMES, R, BASE, TRACK)
TWO = differential(("left", "right"), 0.02, 0.1126)
some = st.floats(-2, 2)


@given(some, some, some)
def test_mecanum_wheels_turn_as_the_formulas_say(x: float, y: float, w: float) -> None:
    # Webots' youBot: front right, front left, rear right, rear left.
    swing = (BASE + TRACK) / 2 * w
    speeds = FOUR.ik((x, y, w))
    assert speeds["fr"] == pytest.approx((x + y + swing) / R, abs=1e-9)
    assert speeds["fl"] == pytest.approx((x - y - swing) / R, abs=1e-9)
    assert speeds["rr"] == pytest.approx((x - y + swing) / R, abs=1e-9)
    assert speeds["rl"] == pytest.approx((x + y - swing) / R, abs=1e-9)
    back = FOUR.fk([*speeds.values()])
    assert back == pytest.approx((x, y, w), abs=1e-9)
    closed = mecanum_speeds(Twist(x, y, w), R, BASE, TRACK)
    assert closed == pytest.approx([*speeds.values()], abs=1e-9)


@given(some, some, some, st.floats(0.1, 3))
def test_what_is_slowed_goes_along_the_same_curve(
    x: float, y: float, turn: float, top: float
) -> None:
    fastest = max(map(abs, mecanum_speeds(Twist(x, y, turn), R, BASE, TRACK)))
    slow = slowed(Twist(x, y, turn), fastest, top)
    speeds = mecanum_speeds(slow, R, BASE, TRACK)
    assert max(map(abs, speeds)) <= top * (1 + 1e-12)
    share = min(1.0, top / max(fastest, 1e-9))
    assert slow == pytest.approx((share * x, share * y, share * turn))
    many = slowed(
        Twist(*(np.array([v, v]) for v in (x, y, turn))), np.array([fastest] * 2), top
    )
    assert [float(part[1]) for part in many] == [*slow]


@given(some, some)
def test_two_wheels_there_and_back(x: float, turn: float) -> None:
    speeds = TWO.ik(Twist(x=x, turn=turn))
    assert TWO.fk([*speeds.values()]) == pytest.approx((x, 0.0, turn), abs=1e-9)


@pytest.mark.parametrize("wheels", [FOUR, TWO])
def test_the_jacobian_is_how_it_goes_by_wheel(wheels: Wheels) -> None:
    count = len(wheels.joints)
    columns = [wheels.fk(np.eye(count)[i].tolist()) for i in range(count)]
    assert np.abs(np.array(columns).T - wheels.jacobian()).max() < 1e-15


@pytest.mark.parametrize("kind", [Woodbot, Create2, Pioneer3AT])
def test_bases_go_as_their_mathematics_do(kind: type[Definition]) -> None:
    robot: Any = kind("bot")
    robot.prepare()
    robot.command = robot.ik((0.05, 0.0, 0.3))
    assert robot.fk() == pytest.approx((0.05, 0.0, 0.3))
    rates = robot.derivative(robot.state, robot.command)
    assert (rates["x"], rates["heading"]) == pytest.approx((0.05, 0.3))


def test_a_differential_drive_does_not_go_sideways() -> None:
    with pytest.raises(UnreachableError, match="these wheels cannot do that") as error:
        TWO.ik((0.1, 0.2, 0.5))
    assert error.value.nearest == pytest.approx(Twist(0.1, 0.0, 0.5))
    assert error.value.away == pytest.approx(0.2)


def test_what_is_too_fast_is_told_with_the_same_curve_slower() -> None:
    slow = mecanum(NAMES, R, BASE, TRACK, top=10.0)
    with pytest.raises(
        UnreachableError, match=r"a wheel would turn at 20 rad/s, and has 10\."
    ) as error:
        slow.ik((1.0, 0.0, 0.0))
    assert error.value.nearest == pytest.approx(Twist(0.5, 0.0, 0.0))
    assert max(slow.ik((0.5, 0.0, 0.0)).values()) == pytest.approx(10.0)


@pytest.mark.parametrize("wrong", [(0.1, 0.2), (0.1, 0.0, float("inf"))])
def test_what_is_no_twist_is_refused(wrong: tuple[float, ...]) -> None:
    with pytest.raises(FieldValueError, match="expected x, y and turn"):
        FOUR.ik(wrong)

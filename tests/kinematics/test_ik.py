"""Inverse kinematics: what can be reached is found, what cannot is said."""

from math import pi
from typing import Any

import numpy as np
import pytest

from rems_net.errors import FieldValueError, RemsError, UnreachableError
from rems_net.kinematics.arm import Arm
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.rotation import Array
from rems_net.robots.youbot import JOINTS, STOPS
from tests.kinematics.arms import ARMS, anywhere, scaler, youbot
from tests.kinematics.figures import HEAD, round_trips, row


@pytest.mark.parametrize("name", ARMS)
def test_round_trips(name: str) -> None:
    found = round_trips(ARMS[name](), 10 if name == "crane" else 40)
    assert found.reached == found.asked
    assert found.worst < 1e-8


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", ARMS)
def test_ten_thousand_round_trips(name: str) -> None:
    found = round_trips(ARMS[name](), 10_000)
    print(f"\n{HEAD}\n{row(name, found)}")
    least = 0.999 if name == "crane" else 1.0
    assert found.reached >= least * found.asked
    assert found.worst < 1e-8


@pytest.mark.parametrize("arm", [youbot(), scaler()], ids=["youbot", "scaler"])
def test_a_warm_start_never_jumps(arm: Arm) -> None:
    random = np.random.default_rng(5)
    start, end = np.array([anywhere(arm, random) for _ in range(2)])
    before = start
    for share in np.linspace(0, 1, 60):
        wanted = start + share * (end - start)
        found = arm.ik(arm.fk(wanted.tolist()), start=before.tolist())
        now = np.array([*found.joints.values()])
        # Through a singular pose it may go on either way; both are as near.
        assert np.abs(now - before).max() <= np.abs(wanted - before).max() + 1e-9
        before = now


def test_each_target_says_as_much_as_it_says() -> None:
    arm = youbot()
    place, pitch, roll = (0.25, 0.1, 0.2), 0.6, 0.4
    told = arm.ik(place, pitch=pitch, roll=roll)
    assert told.pose.position == pytest.approx(place)
    assert told.pose.rotation == pytest.approx(arm.aim(place, pitch, roll).rotation)
    assert told.joints[JOINTS[4]] == pytest.approx(roll)
    bent = sum(told.joints[joint] for joint in JOINTS[1:4])
    assert bent == pytest.approx(pitch + pi / 2)

    start = [0.0, 0.5, 0.5, 0.5, -1.0]
    rolls = arm.ik(place, pitch=pitch, start=start)
    assert rolls.pose.position == pytest.approx(place)
    assert rolls.pose.rotation[2, 2] == pytest.approx(-np.sin(pitch))
    assert rolls.joints[JOINTS[4]] == -1.0

    anyhow = arm.ik(place, start=start)
    assert anyhow.pose.position == pytest.approx(place)


@pytest.mark.parametrize(
    "bends", [(0.4, 0.9, 0.9), (-0.6, -1.0, -0.8), (0.2, 2.2, 1.5)]
)
def test_a_pitch_is_seen_from_the_first_axis(bends: tuple[float, ...]) -> None:
    arm = youbot()
    q = [0.2, *bends, 0.3]
    pose, lean = arm.fk(q), sum(bends)
    outward = np.cos(0.2) * (pose.position[0]) + np.sin(0.2) * pose.position[1]
    # What leans over its own back has its tool on the other side.
    level, down = np.sin(lean) * np.sign(outward), -np.cos(lean)
    found = arm.ik(pose.position, pitch=float(np.arctan2(down, level)), start=q)
    assert [*found.joints.values()] == pytest.approx(q)


@pytest.mark.parametrize("name", ["youbot", "scaler left", "crane"])
def test_stops_are_respected_and_what_is_out_of_reach_is_nearest(name: str) -> None:
    arm, random = ARMS[name](), np.random.default_rng(7)
    some = arm.fk(anywhere(arm, random)).position
    far = some * (2.0 / np.linalg.norm(some))
    with pytest.raises(UnreachableError, match="out of reach") as error:
        arm.ik(far)
    nearest = error.value.nearest
    q = np.array([*nearest.joints.values()])
    assert (q >= arm.low).all()
    assert (q <= arm.high).all()
    assert nearest.pose.position == pytest.approx(arm.fk(q.tolist()).position)
    away = np.linalg.norm(far - nearest.pose.position)
    assert error.value.away == pytest.approx(away)
    for _ in range(200):  # nothing is nearer, wherever one looks
        other = arm.fk(anywhere(arm, random)).position
        assert np.linalg.norm(far - other) >= away - 1e-9


def test_nearest_is_what_mujocos_own_solver_finds() -> None:
    reason = "mujoco is not installed (an extra)"
    minimize = pytest.importorskip("mujoco.minimize", reason=reason)
    arm = youbot()
    goal = Pose.of((0.5, 0.3, 0.4), roll=0.5, pitch=1.0, yaw=0.2)
    with pytest.raises(UnreachableError) as error:
        arm.ik(goal)
    target = arm.target(goal, None, None)
    q = np.array([*error.value.nearest.joints.values()])

    def residual(points: Array) -> Array:
        columns = [target.error(*arm.tip(p.tolist())) for p in points.T]
        return np.array(columns).T

    theirs, _ = minimize.least_squares(
        q + 0.01,
        residual,
        bounds=[arm.low, arm.high],
        xtol=1e-12,
        gtol=1e-12,
        verbose=minimize.Verbosity.SILENT,
    )
    ours = np.linalg.norm(residual(q[:, None]))
    assert ours == pytest.approx(np.linalg.norm(residual(theirs[:, None])), rel=1e-6)


def test_a_singular_pose_is_reached_and_said() -> None:
    arm = youbot()
    stretched = [0.3, 0.7, 0.0, 0.4, 0.1]
    found = arm.ik(arm.fk(stretched), start=stretched)
    assert found.pose.position == pytest.approx(arm.fk(stretched).position)
    assert found.singular.startswith(
        f"Singular: {JOINTS[1]} and {JOINTS[2]} and {JOINTS[3]} can move here"
    )
    assert arm.singular([0.3, 0.7, 0.5, 0.4, 0.1]) == ""

    hand = scaler()
    quarter = [0.1, 0.2, 1.3, 0.4, pi / 2, 0.3]
    found = hand.ik(hand.fk(quarter), start=quarter)
    assert "left/wrist/1 and left/wrist/3 can move" in found.singular


def test_on_the_first_axis_any_turn_will_do() -> None:
    arm = youbot()
    over = [0.4, -0.3, -1.0, -1.2, 0.2]
    pose = arm.fk(over)
    found = arm.ik(pose, start=over)
    assert [*found.joints.values()] == pytest.approx(over)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (
            {"goal": (0.9, 0.0, 0.1), "pitch": 0.0},
            r"\(0\.900, 0\.000, 0\.100\) m turned like that is out of reach: the "
            r"nearest is \(.*\) m, rpy \(.*\) deg, \d+\.\d mm away and \d+\.\d deg "
            r"off\. The point itself is out of reach, however the tool is turned",
        ),
        (
            {"goal": (0.3, 0.1, 0.1), "pitch": -1.5},
            r"The point itself is within reach: ask for it with another pitch, or "
            r"with none\. At its stop there: arm/joint/",
        ),
        ({"goal": (0.3, 0.1)}, "position of a pose is .* expected finite numbers"),
        ({"goal": (0.3, 0.1, float("nan"))}, "expected finite numbers of shape"),
        ({"goal": "home"}, "expected finite numbers"),
        ({"goal": (0.3, 0, 0.1), "roll": 1.0}, "give a pitch, too"),
        ({"goal": Pose.of(), "pitch": 1.0}, "leave out pitch and roll"),
        ({"goal": (0.3, 0, 0.1), "start": [0.0]}, "expected 5 finite numbers, of arm/"),
    ],
)
def test_what_cannot_be_is_said(asked: dict[str, Any], said: str) -> None:
    with pytest.raises(RemsError, match=said) as error:
        youbot().ik(**asked)
    assert isinstance(error.value, UnreachableError | FieldValueError)


def test_the_stops_are_the_makers() -> None:
    arm = youbot()
    assert np.degrees(arm.low) == pytest.approx([low for low, _ in STOPS])
    assert np.degrees(arm.high) == pytest.approx([high for _, high in STOPS])
    # Upright it is as high as the maker says.
    assert arm.fk([0.0] * 5).position == pytest.approx([0.033, 0, 0.655], abs=6e-4)

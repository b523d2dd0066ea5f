"""SCALER's linkage: the vectors of the original's closed form, and its way back."""

from math import pi

import numpy as np
import pytest

from rems_net.errors import SchemaError
from rems_net.kinematics.fivebar import FiveBarArm
from rems_net.kinematics.pose import Pose
from rems_net.robots.limb import BARS, HAND, STOPS, paths
from rems_net.robots.scaler import Scaler
from tests.kinematics.arms import anywhere, scaler

#: joints, wrist in the shoulder's frame (mm), rows of its rotation: from the original
VECTORS = [
    (
        (0, 0, pi / 2, 0, 0, 0),
        (187.632, 0, -297.201),
        ((0, -0.9182, 0.3962), (-1, 0, 0), (0, -0.3962, -0.9182)),
    ),
    (
        (0.3, 0.1, 1.4, 0.2, -0.3, 0.4),
        (183.233, 56.681, -313.797),
        (
            (0.0576, -0.8138, 0.5783),
            (-0.9032, 0.2044, 0.3775),
            (-0.4254, -0.544, -0.7232),
        ),
    ),
    (
        (-0.2, -0.3, 1.2, 0.5, 0.1, -0.6),
        (97.744, -19.814, -355.689),
        (
            (0.4221, -0.9064, 0.0168),
            (-0.797, -0.3622, 0.4833),
            (-0.432, -0.2174, -0.8753),
        ),
    ),
]


@pytest.mark.parametrize(("q", "position", "rotation"), VECTORS)
def test_the_originals_vectors(
    q: tuple[float, ...],
    position: tuple[float, ...],
    rotation: tuple[tuple[float, ...], ...],
) -> None:
    arm = FiveBarArm(paths("x"), STOPS, BARS, hand=HAND)
    pose = arm.fk(q)
    assert pose.position * 1000 == pytest.approx(np.array(position), abs=0.0006)
    assert pose.rotation == pytest.approx(np.array(rotation), abs=0.00006)


def test_the_originals_gripper() -> None:
    # Of leg 3, whose gripper is that of leg 1, the right arm's.
    tool = scaler("right").tool
    arm = FiveBarArm(paths("x"), STOPS, BARS, hand=HAND, tool=tool)
    pose = arm.fk(VECTORS[0][0])
    assert pose.position * 1000 == pytest.approx([284.44, -30.0, -363.80], abs=0.006)


def test_it_closes_wherever_its_servos_can_go() -> None:
    (low, high), (lowest, highest) = STOPS[1], STOPS[2]
    for top in np.linspace(low, high, 60).tolist():
        for bottom in np.linspace(lowest, highest, 60).tolist():
            assert abs(BARS.plate(top, bottom)) <= pi


def test_elbows_that_meet_are_told() -> None:
    with pytest.raises(
        SchemaError, match=r"does not close: .* 3\.\d mm apart; expected 5\.7 to 278\.4"
    ):
        BARS.plate(pi / 2, pi / 2 + 0.25)


def test_arrays_are_the_same_bits_as_one_by_one() -> None:
    arm, random = scaler(), np.random.default_rng(2)
    many = [anywhere(arm, random) for _ in range(50)]
    places, turns = arm.tip(list(np.array(many).T))
    for i, q in enumerate(many):
        place, turn = arm.tip(q)
        assert [p[i] for p in places] == list(place)
        assert [t[i] for t in turns] == list(turn)


def test_the_way_back_has_the_way_there() -> None:
    random = np.random.default_rng(3)
    for _ in range(100):
        _, top, bottom, *_ = anywhere(scaler(), random)
        _, e = BARS.elbows(top, bottom)
        plate = BARS.plate(top, bottom)
        tip = e[0] + BARS.tip * np.sin(plate), e[1] - BARS.tip * np.cos(plate)
        found = np.array(list(BARS.inverse(tip)))
        away = np.abs(found - [top, bottom, plate])
        # An angle of a full turn more is the same one.
        away = np.minimum(away, np.abs(away - 2 * pi))
        assert away.max(axis=1).min() < 1e-9


def test_the_arms_are_mirror_images() -> None:
    robot = Scaler("scaler")
    robot.prepare()
    left, right = robot.fk(of="left"), robot.fk(of="right")
    assert left.position[1] == pytest.approx(0.144 + 0.28444, abs=1e-5)
    assert right.position[1] == pytest.approx(-0.144 - 0.28444, abs=1e-5)
    assert left.position[2] == pytest.approx(right.position[2])


def test_what_the_original_begins_with_can_be_reached() -> None:
    # 0.25 m out and 0.25 m down of its shoulder, the wrist turned by diag(1, -1, -1).
    arm = FiveBarArm(paths("x"), STOPS, BARS, hand=HAND)
    goal = Pose(np.array([0.25, 0.0, -0.25]), np.diag([1.0, -1.0, -1.0]))
    assert arm.ik(goal).pose.position == pytest.approx(goal.position)

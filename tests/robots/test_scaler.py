"""SCALER-M: two arms that go where they are told, each at its own speed."""

from __future__ import annotations

from math import pi

import pytest

from rems_net.agents.robot import combine
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.errors import FieldValueError
from rems_net.robots.limb import JOINTS
from rems_net.robots.scaler import ARMS, Scaler
from tests.robots.test_youbot import drive, made


def test_ports() -> None:
    joints = [f"{arm}/{joint}" for arm in ARMS for joint in JOINTS]
    assert list(Scaler.state.schema.paths) == joints
    assert set(Scaler.command.schema.paths) == {*joints, "left/speed", "right/speed"}
    assert Scaler.state.schema()["left/bottom"] == pi / 2


def test_each_arm_goes_at_its_own_speed() -> None:
    robot = made(Scaler, parameters={"joint_speed": 1.0})
    told = {"left/shoulder": 0.8, "left/speed": 1.0, "right/shoulder": -0.8}
    drive(robot, told | {"right/speed": 0.25}, steps=4)
    assert robot.state["left/shoulder"] == pytest.approx(0.4)
    assert robot.state["right/shoulder"] == pytest.approx(-0.1)
    assert robot.sensors["right/velocity/shoulder"] == -0.25
    assert robot.state["left/bottom"] == pi / 2


def test_an_arm_reaches_for_a_pose() -> None:
    robot = made(Scaler)
    goal = robot.fk({"left/top": 0.4, "left/wrist/2": "20 deg"}, of="left")
    found = robot.ik(goal, of="left")
    drive(robot, found.joints | {"left/speed": 0.5}, steps=20)
    assert robot.fk(of="left").position == pytest.approx(goal.position)
    assert robot.fk(of="left").rotation == pytest.approx(goal.rotation)


def test_there_are_two_arms_to_choose_from() -> None:
    robot = combine(Scaler, Kinematic)("bot")
    robot.prepare()
    with pytest.raises(FieldValueError, match="has 'left', 'right'; got of=''"):
        robot.fk()

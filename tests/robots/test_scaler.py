"""SCALER-M: two arms that go where they are told, each at its own speed."""

from math import pi

import pytest

from rems_net import Experiment, Input, Out, Tick
from rems_net.agents.robot import combine
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.errors import FieldValueError
from rems_net.maths import sin
from rems_net.robots.limb import JOINTS, paths
from rems_net.robots.scaler import ARMS, Scaler, ScalerLeft
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


class Reach(Input):
    """Swings the left arm, faster and slower, and lets it hold now and then."""

    value = Out(ScalerLeft.command)

    def read(self, tick: Tick) -> dict[str, float]:
        ways = {path: 0.5 + 0.4 * sin(3 * tick.t) for path in paths("left")}
        return {**ways, "left/speed": max(0.0, sin(tick.t))}


def test_the_left_arm_alone_moves_as_in_the_whole_robot() -> None:
    """To the bit: the whole robot's command has the same fields, and more."""
    lab = Experiment("arms", dt=0.05, duration=4.0)
    lab.input("reach", Reach)
    for name in ("scaler", "scaler_left"):
        lab.robot(name, name, "kinematic", command=["input/reach"])
    with lab.engine() as engine:
        whole, left = engine["robot/scaler"], engine["robot/scaler_left"]
        for _ in range(80):
            engine.step()
            assert left.command.flat().items() <= whole.command.flat().items()
            assert left.state.flat().items() <= whole.state.flat().items()
            assert left.sensors.flat().items() <= whole.sensors.flat().items()
        assert left.state["left/shoulder"] != 0.0
        alone, both = left.fk(), whole.fk(of="left")
        assert alone.position.tolist() == both.position.tolist()
        assert alone.rotation.tolist() == both.rotation.tolist()
        assert left.ik(both).joints == whole.ik(both, of="left").joints
        assert left.tool() == whole.tool("left")


def test_the_left_arm_has_the_fields_and_limits_of_the_whole() -> None:
    for port in ("command", "state", "sensors"):
        whole = getattr(Scaler, port).schema
        rows = [(path, field) for path, field in whole.rows() if path[:4] == "left"]
        assert list(getattr(ScalerLeft, port).schema.rows()) == rows
    robot = made(ScalerLeft)
    joints = ScalerLeft("left").body().joints
    assert [joint.name for joint in joints] == ["left/shoulder"]
    with pytest.raises(FieldValueError, match=r"from -1\.2 to 1\.2"):
        robot.command["left/shoulder"] = 1.3

"""The youBot, its base and its arm: what they say, and as their own mathematics go."""

import math
from collections.abc import Mapping
from math import pi
from typing import Any

import numpy as np
import pytest

from rems_net.agents.robot import Definition, combine
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import outcome, perform, verbs_of
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.kinematic.swarm import Swarm
from rems_net.errors import FieldValueError, UnreachableError
from rems_net.kinematics.wheels import Twist
from rems_net.robots.scaler import Scaler
from rems_net.robots.youbot import JOINTS, TWIST, WHEELS, Youbot, YoubotArm, YoubotBase
from rems_net.robots.youbot.body import FINGER_TRAVEL


def made(kind: type[Definition], **more: Any) -> Kinematic:
    robot = combine(kind, Kinematic)("bot", **more)
    robot.prepare()
    assert isinstance(robot, Kinematic)
    return robot


def command(twist: Twist) -> dict[str, float]:
    return dict(zip(TWIST, twist, strict=True))


def drive(robot: Kinematic, command: Mapping[str, Any], steps: int = 10) -> None:
    robot.command = command
    for _ in range(steps):
        robot.drive(robot.command, 0.1)
        robot.sense()


def test_a_youbot_has_all_of_its_base_and_its_arm() -> None:
    whole = made(Youbot)
    base, arm = made(YoubotBase), made(YoubotArm)
    for port in ("parameters", "command", "state"):
        parts = [getattr(part, port).schema.paths for part in (base, arm)]
        assert getattr(whole, port).schema.paths == (*parts[0], *parts[1])
    assert whole.sensors.schema.paths == arm.sensors.schema.paths


@pytest.mark.parametrize(
    ("twist", "there"),
    [
        (Twist(0.4, 0, 0), (0.4, 0, 0)),
        (Twist(0, 0.3, 0), (0, 0.3, 0)),
        (Twist(0, 0, 0.5), (0, 0, 0.5)),
    ],
)
def test_the_base_goes_where_its_wheels_roll(
    twist: Twist, there: tuple[float, float, float]
) -> None:
    base = made(YoubotBase)
    drive(base, command(twist))
    state = base.state
    assert (state.x, state.y, state.heading) == pytest.approx(there)
    for path, speed in base.ik(twist).items():
        assert state[path] == pytest.approx(speed)
    assert base.fk() == pytest.approx(twist)


def test_sideways_is_to_its_own_left() -> None:
    base = made(YoubotBase, initial={"heading": pi / 2})
    drive(base, {"linear/y": 0.2})
    assert (base.state.x, base.state.y) == pytest.approx((-0.2, 0.0))


def test_a_base_that_is_told_more_than_its_wheels_can_goes_the_same_way_slower() -> (
    None
):
    base = made(YoubotBase)
    drive(base, {"linear/x": "0.7 m/s", "linear/y": -0.35, "angular/z": 0.5}, steps=1)
    top = base.parameters.max_wheel_speed
    turning = base.motor_command(base.command)
    assert max(abs(turning[path]) for path in WHEELS) == pytest.approx(top)
    going = base.fk()
    share = 14.81 * 0.05 / (0.7 + 0.35 + 0.386 * 0.5)
    assert going == pytest.approx((0.7 * share, -0.35 * share, 0.5 * share))
    assert base.state["heading"] == pytest.approx(0.1 * 0.5 * share)
    with pytest.raises(FieldValueError, match=r"'linear/x' expects .*-0\.7405"):
        base.command = {"linear/x": 0.75}


def test_an_arm_goes_to_its_target_and_halts_there_to_the_last_bit() -> None:
    arm = made(YoubotArm, parameters={"joint_speed": 1.0})
    told = {"arm/joint/1": 0.35, "arm/joint/3": -0.1, "arm/speed": 0.5}
    drive(arm, told, steps=3)
    assert arm.state["arm/joint/1"] == pytest.approx(0.15)
    assert arm.state["arm/joint/3"] == -0.1
    assert arm.sensors["arm/velocity/1"] == 0.5
    assert arm.sensors["arm/velocity/3"] == 0.0
    drive(arm, told, steps=10)
    assert arm.state["arm/joint/1"] == 0.35
    assert arm.sensors["arm/velocity/1"] == 0.0


@pytest.mark.parametrize("options", [{}, {"integrator": "rk4"}, {"substeps": 7}])
def test_however_long_a_step_is_it_does_not_go_past(options: dict[str, Any]) -> None:
    robot = made(Youbot, options=options)
    robot.command = {"arm/joint/2": 1.0, "arm/gripper": 0.01, "arm/speed": 1.0}
    robot.drive(robot.command, 30.0)
    assert robot.state["arm/joint/2"] == 1.0
    assert robot.state["arm/gripper"] == 0.01


def test_an_arm_that_is_told_nothing_holds_where_it_is() -> None:
    robot = made(Youbot)
    drive(robot, {"arm/joint/2": 1.2, "arm/speed": 1.0, "linear/x": 0.3}, 3)
    before = robot.state.copy()
    runtime(robot).stopped = True
    robot.step(Tick(4, 0.4, 0.1))
    assert robot.state == before
    assert before["arm/joint/2"] == pytest.approx(0.47124)


def test_a_target_beyond_a_stop_is_refused() -> None:
    arm = made(YoubotArm)
    with pytest.raises(FieldValueError, match=r"'arm/joint/2' expects .* rad"):
        arm.command = {"arm/joint/2": "-70 deg"}
    assert arm.command.clip({"arm/joint/2": "-70 deg"}) == {
        "arm/joint/2": math.radians(-65)
    }
    assert arm.command.clip({"arm/gripper": 1.0}) == {"arm/gripper": FINGER_TRAVEL}


def test_what_ik_finds_is_a_command() -> None:
    robot = made(Youbot)
    goal = (0.45, 0.1, 0.15)
    found = robot.ik(goal, of="arm", pitch=1.0)
    drive(robot, found.joints | {"arm/speed": 1.0}, steps=30)
    assert robot.fk(of="arm").position == pytest.approx(goal)
    # From there on it is the start of what is asked for next.
    near = robot.ik((0.45, 0.1, 0.16), of="arm", pitch=1.0)
    moved = [near.joints[path] - found.joints[path] for path in JOINTS]
    assert max(map(abs, moved)) < 0.2


def test_where_its_tool_is_can_be_asked_from_outside() -> None:
    robot = made(Youbot)
    drive(robot, {"arm/joint/2": "90 deg", "arm/speed": 1.0}, steps=20)
    told = outcome("robot/bot", perform(verbs_of(robot), "tool", b""))
    assert told["x"] == pytest.approx(0.167 + 0.033 + 0.5075)
    assert (told["roll"], told["pitch"]) == pytest.approx((0.0, pi / 2))


def test_units_and_names_are_understood_or_refused() -> None:
    robot = made(Youbot)
    straight = robot.fk({"arm/joint/2": "90 deg"}, of="arm").position
    assert straight == pytest.approx([0.167 + 0.033 + 0.5075, 0, 0.048 + 0.147])
    assert robot.jacobian(of="base").shape == (3, 4)
    assert robot.jacobian({"arm/joint/2": 1.0}, of="arm").shape == (6, 5)
    twist = robot.fk(dict.fromkeys(WHEELS, 1.0), of="base")
    assert twist == pytest.approx((0.05, 0, 0))
    with pytest.raises(FieldValueError, match=r"'base', 'arm'; got of='amr'.*'arm'"):
        robot.fk(of="amr")
    with pytest.raises(UnreachableError, match="wheel would turn at"):
        robot.ik((3.0, 0.0, 0.0), of="base")


@pytest.mark.parametrize("kind", [YoubotBase, YoubotArm, Youbot, Scaler])
def test_a_swarm_steps_as_its_robots_do_to_the_last_bit(
    kind: type[Definition],
) -> None:
    alone, together = ([made(kind) for _ in range(5)] for _ in range(2))
    swarm = Swarm.of(together)
    assert swarm is not None
    random = np.random.default_rng(1)
    for n in range(1, 12):
        tick = Tick(n, n / 10, 0.1)
        for pair in zip(alone, together, strict=True):
            schema = pair[0].command.schema
            told = {}
            for path, field in zip(schema.paths, schema.fields, strict=True):
                low, high = field.limits
                told[path] = low + (high - low) * float(random.random())
            for robot in pair:
                robot.command = told
        for robot in alone:
            robot.step(tick)
        swarm.step(tick)
        for a, b in zip(alone, together, strict=True):
            assert a.state.encode() == b.state.encode()
            if kind is not YoubotBase:
                assert a.sensors.encode() == b.sensors.encode()

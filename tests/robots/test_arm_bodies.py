"""Bodies with arms: their trees are their kinematics, and both engines move them so."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from rems_net.agents.robot import Definition, Driver, Robot, join
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.robots import scaler, youbot
from rems_net.robots.scaler import Scaler
from rems_net.robots.youbot import WHEELS, Youbot, YoubotArm, YoubotBase
from rems_net.worlds.tree import Tree
from tests.drivers.physics.test_physics import ENGINES

Engine = type[Driver]
ENGINE = pytest.mark.parametrize("engine", ENGINES)
#: each arm: its robot, its name there, and its joints
HANDS = [
    (YoubotArm, "arm", list(youbot.JOINTS)),
    (Youbot, "arm", list(youbot.JOINTS)),
    (Scaler, "left", scaler.paths("left")),
    (Scaler, "right", scaler.paths("right")),
]


@contextmanager
def running(
    definition: type[Definition], driver: Engine, **settings: Any
) -> Iterator[Robot]:
    robot = join(definition, driver)("r", **settings)
    robot.prepare()
    try:
        robot.open()
        yield robot
    finally:
        robot.close()


def obey(robot: Robot, command: Mapping[str, Any], dt: float = 0.05) -> None:
    robot.command = command
    robot.drive(robot.command, dt)
    robot.sense()


@pytest.mark.parametrize(("definition", "name", "joints"), HANDS)
def test_a_body_is_built_as_its_kinematics_say(
    definition: type[Definition], name: str, joints: list[str]
) -> None:
    """Where its last link is and how it is turned, for joints anywhere."""
    robot: Any = join(definition, Kinematic)("r")
    robot.prepare()
    tree = Tree(robot.body())
    last = tree.number(joints[-1])
    draws, found = np.random.default_rng(13), []
    for _ in range(10):
        limits = [robot.command.schema[path].limits for path in joints]
        angles = {
            path: draws.uniform(low, high)
            for path, (low, high) in zip(joints, limits, strict=True)
        }
        tool = robot.fk(angles, of=name)
        positions = tree.closed({tree.number(path): q for path, q in angles.items()})
        points, turns = tree.places(positions)
        # The tool as the link carries it: the same for all joints.
        at = turns[last].T @ (tool.position - points[last])
        found.append((at, turns[last].T @ tool.rotation))
    for at, rotation in found[1:]:
        assert at == pytest.approx(found[0][0], abs=1e-12)
        assert rotation == pytest.approx(found[0][1], abs=1e-12)


REACH = {
    "arm/joint/1": 0.6,
    "arm/joint/2": 0.5,
    "arm/joint/3": -0.4,
    "arm/joint/4": 0.4,
    "arm/joint/5": -0.5,
    "arm/gripper": 0.01,
    "arm/speed": 0.25,
}
STRETCH = {
    "left/shoulder": 0.3,
    "left/top": 0.3,
    "left/bottom": 1.2,
    "left/wrist/1": 0.4,
    "left/wrist/2": -0.3,
    "left/wrist/3": 0.4,
    "left/speed": 0.1,
    "right/top": -0.3,
    "right/bottom": 1.8,
    "right/speed": 0.1,
}


@ENGINE
@pytest.mark.parametrize(("definition", "told"), [(Youbot, REACH), (Scaler, STRETCH)])
def test_arms_go_as_their_mathematics_say(
    engine: Engine, definition: type[Definition], told: Mapping[str, float]
) -> None:
    with running(definition, engine) as robot, running(definition, Kinematic) as model:
        for _ in range(40):
            obey(robot, told)
            obey(model, told)
            for path in told.keys() & set(robot.state.schema.paths):
                off = abs(robot.state[path] - model.state[path])
                assert off < 0.02 * (0.0115 if path == "arm/gripper" else 1.0), path
        for path in robot.state.schema.paths:
            if path in told:
                assert robot.state[path] == pytest.approx(told[path], abs=3e-3)


@ENGINE
def test_an_arm_that_is_told_to_halt_holds_its_weight(engine: Engine) -> None:
    out = {"arm/joint/2": 1.2, "arm/joint/3": 0.3}
    with running(YoubotArm, engine, initial=out) as robot:
        for _ in range(40):
            obey(robot, {"arm/joint/2": -0.5, "arm/speed": 0.0})
        assert robot.state["arm/joint/2"] == pytest.approx(1.2, abs=5e-3)
        assert robot.state["arm/joint/3"] == pytest.approx(0.3, abs=5e-3)


@ENGINE
def test_the_loops_of_scaler_stay_closed(engine: Engine) -> None:
    with running(Scaler, engine) as robot:
        member: Any = vars(robot)["_member"]
        tree = member.tree
        for n in range(30):
            top = 0.6 if n // 10 == 1 else -0.6
            obey(robot, {**STRETCH, "left/speed": 0.2, "left/top": top})
            positions, _ = member.instance.joints()
            points, turns = tree.places(positions)
            for first, at, second, there in tree.ends():
                one = points[first] + turns[first] @ at
                other = points[second] + turns[second] @ there
                assert np.linalg.norm(one - other) < 1e-3


@ENGINE
@pytest.mark.parametrize("way", [(1, 1, 1, 1), (-1, 1, 1, -1), (-1, 1, -1, 1)])
@pytest.mark.parametrize("definition", [YoubotBase, Youbot])
def test_a_youbot_drives_as_its_mathematics_say(
    engine: Engine, definition: type[Definition], way: tuple[int, ...]
) -> None:
    told = {path: 4.0 * share for path, share in zip(WHEELS, way, strict=True)}
    initial = {"heading": 0.5}
    with (
        running(definition, engine, initial=initial) as robot,
        running(definition, Kinematic, initial=initial) as model,
    ):
        for _ in range(6):  # gathers speed
            obey(robot, told)
        begin = {path: robot.state[path] for path in ("x", "y", "heading")}
        model.state = begin
        for _ in range(20):
            obey(robot, told)
            obey(model, told)
        far = max(abs(model.state[path] - begin[path]) for path in begin)
        for path in begin:
            assert abs(robot.state[path] - model.state[path]) < 0.01 * far, path


def test_mujoco_has_the_hand_where_the_kinematics_say() -> None:
    mujoco = pytest.importorskip(
        "mujoco", reason="mujoco is not installed, so its own kinematics are not asked"
    )
    from rems_net.drivers.physics.scenery import mjcf
    from rems_net.worlds.scene import Scene

    robot: Any = join(Youbot, Kinematic)("r")
    robot.prepare()
    body = robot.body()
    model = mujoco.MjModel.from_xml_string(mjcf([body], Scene()))
    data = mujoco.MjData(model)
    draws = np.random.default_rng(13)
    for _ in range(20):
        angles = {}
        for path in youbot.JOINTS:
            angles[path] = draws.uniform(*robot.command.schema[path].limits)
            data.joint(f"0/{path}").qpos[0] = angles[path]
        mujoco.mj_kinematics(model, data)
        hand = data.body(f"0/{youbot.JOINTS[-1]}")
        tool = hand.xpos + hand.xmat.reshape(3, 3) @ (0, 0, youbot.PROPORTIONS.tool)
        found = robot.fk(angles, of="arm")
        assert tool - (0, 0, body.height) == pytest.approx(found.position, abs=1e-9)
        assert hand.xmat.reshape(3, 3) == pytest.approx(found.rotation, abs=1e-9)

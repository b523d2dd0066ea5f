"""Bodies with arms: their trees are their kinematics, and both engines move them so."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net.agents.robot import Definition, Driver, combine
from rems_net.bodies.body import Box
from rems_net.bodies.tree import Tree
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.scenery import mjcf
from rems_net.robots import limb, youbot
from rems_net.robots.scaler import Scaler, ScalerLeft
from rems_net.robots.youbot import Youbot, YoubotArm, YoubotBase
from rems_net.robots.youbot.body import FINGER_TRAVEL
from rems_net.scenes.scene import Scene, Thing
from tests.drivers.physics.test_physics import ENGINES, needs
from tests.robots.moving import REACH, STRETCH, WAYS, astray, behind, gap, obey, running

Engine = type[Driver]
ENGINE = pytest.mark.parametrize("engine", ENGINES)
#: each arm: its robot, its name there, and its joints
HANDS = [
    (YoubotArm, "arm", list(youbot.JOINTS)),
    (Youbot, "arm", list(youbot.JOINTS)),
    (Scaler, "left", limb.paths("left")),
    (Scaler, "right", limb.paths("right")),
    (ScalerLeft, "left", limb.paths("left")),
]


#: where the left arm goes alone
LEFT = {path: told for path, told in STRETCH.items() if path.startswith("left")}


@pytest.mark.parametrize(("definition", "name", "joints"), HANDS)
def test_a_body_is_built_as_its_kinematics_say(
    definition: type[Definition], name: str, joints: list[str]
) -> None:
    """Where its last link is and how it is turned, for joints anywhere."""
    robot: Any = combine(definition, Kinematic)("r")
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
        assert at == pytest.approx(found[0][0], abs=1e-10)
        assert rotation == pytest.approx(found[0][1], abs=1e-10)


@ENGINE
@pytest.mark.parametrize(
    ("definition", "told"), [(Youbot, REACH), (Scaler, STRETCH), (ScalerLeft, LEFT)]
)
def test_arms_go_as_their_mathematics_say(
    engine: Engine, definition: type[Definition], told: Mapping[str, float]
) -> None:
    worst = behind(engine, definition, told)
    assert worst.pop("arm/gripper", 0.0) < 0.02 * FINGER_TRAVEL
    assert max(worst.values()) < 0.02


@ENGINE
def test_an_arm_that_is_told_to_halt_holds_its_weight(engine: Engine) -> None:
    out = {"arm/joint/2": 1.2, "arm/joint/3": 0.3}
    with running(YoubotArm, engine, initial=out) as robot:
        for _ in range(40):
            obey(robot, {"arm/joint/2": -0.5, "arm/speed": 0.0})
        assert robot.state["arm/joint/2"] == pytest.approx(1.2, abs=5e-3)
        assert robot.state["arm/joint/3"] == pytest.approx(0.3, abs=5e-3)


@ENGINE
def test_a_youbot_that_is_told_nothing_stands(engine: Engine) -> None:
    initial = {"heading": 0.4, "arm/joint/2": 0.9}
    with running(Youbot, engine, initial=initial) as robot:
        for _ in range(20):
            obey(robot, {})
        assert abs(robot.state["x"]) + abs(robot.state["y"]) < 1e-4
        assert robot.state["heading"] == pytest.approx(0.4, abs=1e-4)


@ENGINE
def test_the_loops_of_scaler_stay_closed(engine: Engine) -> None:
    with running(Scaler, engine) as robot:
        for n in range(30):
            top = 0.6 if n // 10 == 1 else -0.6
            obey(robot, {**STRETCH, "left/speed": 0.2, "left/top": top})
            assert gap(robot) < 1e-3


@ENGINE
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("definition", [YoubotBase, Youbot])
def test_a_youbot_drives_as_its_mathematics_say(
    engine: Engine, definition: type[Definition], way: str
) -> None:
    """Within 1 % of 0.4 m and of 1 rad, at a heading where Bullet has its troubles."""
    off, turned = astray(engine, definition, WAYS[way], heading=0.5)
    assert off < 0.004
    assert turned < 0.01


@ENGINE
def test_a_gripper_lifts_a_post_and_holds_it(engine: Engine) -> None:
    robot: Any = combine(YoubotArm, engine)("r")
    robot.prepare()
    post = Thing("post", Box((0.02, 0.02, 0.24)), (0.45, 0.0, 0.12), mass=0.05)
    world = type(robot).share([robot], Scene(things=(post,)))
    robot.open()

    def go(steps: int, speed: float, gripper: float, *at: float) -> None:
        joints = robot.ik(at, pitch=0.0).joints if at else {}
        for _ in range(steps):
            obey(robot, {**joints, "arm/gripper": gripper, "arm/speed": speed})

    go(45, 0.5, FINGER_TRAVEL, 0.36, 0.0, 0.2)
    go(30, 0.25, FINGER_TRAVEL, 0.45, 0.0, 0.2)
    go(5, 1.0, 0.0)
    go(40, 0.1, 0.0, 0.42, 0.0, 0.28)
    go(20, 0.0, 0.0)
    up, turn = world.thing(0)
    assert up[2] - 0.12 > 0.07
    assert turn[2, 2] > 0.95  # and it hangs upright
    robot.close()


@pytest.mark.parametrize("engine", [pytest.param(Mujoco, marks=needs("mujoco"))])
def test_rollers_roll_on_a_floor_of_the_users_own(
    engine: Engine, tmp_path: Path
) -> None:
    plane = '<geom type="plane" size="5 5 .1" friction="1 .01 .001"/>'
    file = tmp_path / "place.xml"
    file.write_text(f"<mujoco><worldbody>{plane}</worldbody></mujoco>")
    robot: Any = combine(YoubotBase, engine)("r")
    robot.prepare()
    type(robot).share([robot], Scene(mjcf=str(file)))
    robot.open()
    for _ in range(20):
        obey(robot, {"linear/y": 0.4})
    assert robot.state["y"] == pytest.approx(0.4, rel=0.1)
    assert abs(robot.state["x"]) < 0.01
    robot.close()


def test_mujoco_has_the_hand_where_the_kinematics_say() -> None:
    mujoco = pytest.importorskip(
        "mujoco", reason="mujoco is not installed, so its own kinematics are not asked"
    )
    robot: Any = combine(Youbot, Kinematic)("r")
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

"""Accelerometers: the same by mathematics and in both engines, and as MuJoCo has it."""

from typing import Any

import numpy as np
import pytest

from rems_net import Experiment, Out, Schema
from rems_net.agents.robot import combine
from rems_net.agents.tick import Tick
from rems_net.bodies.body import Part, Sphere
from rems_net.defdict import angle, length
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.kinematic.swarm import Swarm
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.errors import SchemaError
from rems_net.robots.epuck import Epuck
from tests.drivers.physics.test_physics import ENGINES, needs

each = pytest.mark.parametrize("driver", [Kinematic, *ENGINES])
DT, RADIUS, TRACK = 0.05, 0.02, 0.052


class Tipped(Epuck):
    """An e-puck that lies on its nose: it has no feet, and a load in front."""

    def chassis(self, mass: float) -> tuple[Part, ...]:
        *parts, _, _ = super().chassis(mass - 0.02)
        return *parts, Part(Sphere(0.002), 0.02, (0.03, 0.0, -0.004), friction=0.01)


def opened(driver: Any, definition: Any = Epuck, **more: Any) -> Any:
    robot: Any = combine(definition, driver)("e", **more)
    robot.prepare()
    robot.open()
    return robot


def felt(robot: Any, left: float, right: float, ticks: int = 1) -> np.ndarray[Any, Any]:
    """What it feels in each of so many ticks (n, 3), wheels at these speeds, rad/s."""
    robot.command = {"wheel/left": left, "wheel/right": right}
    found = []
    for _ in range(ticks):
        robot.drive(robot.command, DT)
        robot.sense()
        found.append([robot.sensors[f"acceleration/{axis}"] for axis in "xyz"])
    return np.array(found)


@each
def test_at_rest_it_feels_what_holds_it_up(driver: Any) -> None:
    robot = opened(driver, initial={"heading": 1.0})
    np.testing.assert_allclose(felt(robot, 0, 0, 3), [[0, 0, 9.81]] * 3, atol=2e-2)
    robot.close()


@pytest.mark.parametrize("driver", ENGINES)
def test_on_its_nose_it_feels_its_back(driver: Any) -> None:
    """What holds it up comes from below and from behind."""
    robot = opened(driver, Tipped)
    ahead, left, up = felt(robot, 0, 0)[0]
    assert -2.0 < ahead < -1.0
    assert left == pytest.approx(0.0, abs=0.05)
    assert np.hypot(ahead, up) == pytest.approx(9.81, abs=0.05)
    robot.close()


@each
def test_it_feels_how_it_speeds_up_and_brakes(driver: Any) -> None:
    """Over the ticks it adds up to the speed, and to nothing again."""
    robot = opened(driver)
    gained = felt(robot, 5.0, 5.0, 6)[:, 0].sum() * DT
    assert gained == pytest.approx(5.0 * RADIUS, rel=0.05)
    lost = felt(robot, 0.0, 0.0, 6)[:, 0].sum() * DT
    assert lost == pytest.approx(-gained, rel=0.05)
    robot.close()


@each
def test_in_a_circle_it_feels_the_middle(driver: Any) -> None:
    """Speed times turning, to the left: the middle of a circle to the left."""
    robot = opened(driver)
    felt(robot, 2.0, 5.0, 20)
    ahead, left, up = felt(robot, 2.0, 5.0, 20).mean(axis=0)
    speed, turning = RADIUS * 3.5, RADIUS * 3.0 / TRACK
    assert left == pytest.approx(speed * turning, rel=0.03)
    assert ahead == pytest.approx(0.0, abs=5e-3)
    assert up == pytest.approx(9.81, abs=2e-2)
    robot.close()


@each
def test_what_follows_a_reset_is_the_same(driver: Any) -> None:
    robot = opened(driver)
    found = []
    for _ in range(2):
        found.append(felt(robot, 5.0, 1.0, 4).tobytes())
        robot.reset()
    assert found[0] == found[1]
    robot.close()


@each
def test_it_feels_a_wall(driver: Any) -> None:
    """And what it reads is the same, whether it is alone there or with others."""
    walls = {"size": [0.5, 0.5]}
    name = driver.__name__.lower()
    found = []
    for others in (0, 1):
        lab = Experiment("bump", dt=DT, duration="1 s")
        lab.world("arena", options=walls)
        for i in range(1 + others):
            lab.robot(f"e{i}", "epuck", name, world="arena", initial={"y": 0.15 * i})
        agents: dict[str, Any] = dict(lab.check())
        robots = [agents[f"robot/e{i}"] for i in range(1 + others)]
        reads = []
        for robot in robots:
            robot.open()
        robots[0].command = {"wheel/left": 6.0, "wheel/right": 6.0}
        for _ in range(40):
            robots[0].shared.advance(DT)
            robots[0].sense()
            reads.append(robots[0].sensors["acceleration/x"])
        for robot in robots:
            robot.close()
        found.append(reads)
    alone, together = np.array(found)
    assert robots[0].state["x"] == pytest.approx(0.25 - 0.0355, abs=3e-3)
    bump = int(alone.argmin())
    assert 30 < bump < 40
    assert alone[bump] < -1.0
    np.testing.assert_allclose(together[:bump], alone[:bump], atol=5e-3)


@needs("mujoco")
@pytest.mark.parametrize("definition", [Epuck, Tipped])
def test_it_is_what_mujoco_itself_says(definition: Any) -> None:
    """The mean of MuJoCo's own acceleration of the body, over the steps of a tick."""
    mujoco = pytest.importorskip("mujoco")
    robot = opened(Mujoco, definition)
    felt(robot, 2.0, 4.0, 2)
    member, world = robot.member, robot._world
    engine, now = world._engine, world._now
    model, data, body = engine._model, engine._data, member.instance.body
    robot.command = {"wheel/left": 5.0, "wheel/right": 1.0}
    h, six = 0.001, np.zeros(6)
    model.opt.timestep = h
    engine.command([member.targets(robot.command)])
    mean = np.zeros(3)
    count = round(DT / h)
    for _ in range(count):
        mujoco.mj_step1(model, data)
        mujoco.mj_step2(model, data)
        mujoco.mj_rnePostConstraint(model, data)
        mujoco.mj_objectAcceleration(
            model, data, mujoco.mjtObj.mjOBJ_XBODY, body, six, 1
        )
        mean += six[3:] / count
    mujoco.mj_kinematics(model, data)
    now.look()
    now.sense()
    member.feel(DT)
    np.testing.assert_allclose(now.felt[0], mean, atol=0.02)
    robot.close()


def test_angles_in_degrees_are_refused() -> None:
    """Or what it feels would be along some other way."""

    class Degrees(Epuck):
        state = Out(
            Schema("s", {"x": length(), "y": length(), "heading": angle("deg")})
        )
        angles = False

    with pytest.raises(SchemaError, match="'heading' of the state in rad, but s has"):
        combine(Degrees, Kinematic)("d").prepare()


def test_a_swarm_feels_the_same_to_the_last_bit() -> None:
    def crew() -> list[Any]:
        return [opened(Kinematic, initial={"heading": 0.3 * i}) for i in range(3)]

    def told(robot: Any, tick: int, i: int) -> None:
        robot.command = {"wheel/left": 1.0 + 0.5 * tick * i, "wheel/right": 4.0 - i}

    alone, together = crew(), crew()
    swarm = Swarm.of(together)
    assert swarm is not None
    for n in range(4):
        tick = Tick(n, n * DT, DT)
        for i, (one, other) in enumerate(zip(alone, together, strict=True)):
            told(one, n, i)
            told(other, n, i)
            one.step(tick)
        swarm.step(tick)
        if n == 1:
            alone[1].reset()
            together[1].reset()
        for one, other in zip(alone, together, strict=True):
            assert one.sensors.encode() == other.sensors.encode()
    assert alone[0].sensors["acceleration/y"] > 0.05

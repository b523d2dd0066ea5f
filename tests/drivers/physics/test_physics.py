"""Both physics engines, by the same tests: what drives, slips, stalls and stays."""

import struct
import sys
from dataclasses import replace
from importlib.util import find_spec
from math import hypot, pi
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.ports import In, Out
from rems_net.agents.robot import Definition, Driver, Robot, combine
from rems_net.bodies.body import Arena, Body, Box, Cylinder, Hinge, Part, Sphere
from rems_net.defdict import Schema, angle, angular_velocity, length
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.errors import AgentError, FieldValueError, MissingPartError, SchemaError
from rems_net.libraries import no_wheels
from rems_net.robots.woodbot import Woodbot
from tests.commands import finished
from tests.robots.figures import drive, rates, woodbot


def needs(library: str) -> pytest.MarkDecorator:
    return pytest.mark.skipif(
        find_spec(library) is None,
        reason=f"{library} is not installed, so its Woodbot is not tested: "
        f'pip install "rems-net[{library}]"',
    )


ENGINES = [
    pytest.param(Mujoco, marks=needs("mujoco")),
    pytest.param(Pybullet, marks=needs("pybullet")),
]
pytestmark = pytest.mark.parametrize("engine", ENGINES)
Engine = type[Driver]


def bits(robot: Robot) -> bytes:
    """State and sensors, to the last bit."""
    numbers = [robot.state[path] for path in robot.state.schema.paths]
    numbers += [robot.sensors[path] for path in robot.sensors.schema.paths]
    return struct.pack(f"{len(numbers)}d", *numbers)


class OnBlock(Woodbot):
    """A Woodbot on a block that holds its wheels and its tail 5 mm above the floor."""

    def body(self) -> Body:
        body = super().body()
        clear = 0.005
        block = Box((0.04, 0.04, 0.01))
        at = (self.parameters.centre_of_mass, 0.0, 0.005 - body.height - clear)
        parts = (*body.parts, Part(block, 0.01, at, friction=0.8))
        return replace(body, parts=parts, height=body.height + clear)


@pytest.mark.parametrize(
    ("parameters", "straight", "spin", "turn"),
    [
        ({}, 0.146, 2.593, 1.297),
        ({"track": 0.1, "max_wheel_speed": 6.8}, 0.136, 2.72, 1.36),
        ({"max_wheel_speed": 8.0}, 0.160, 2.842, 1.421),
    ],
)
def test_full_speed(
    engine: Engine,
    parameters: dict[str, float],
    straight: float,
    spin: float,
    turn: float,
) -> None:
    def rate(left: float, right: float) -> dict[str, float]:
        return rates(engine, left, right, parameters={**parameters, "arena_radius": 0})

    ahead = rate(1, 1)
    assert ahead["x"] == pytest.approx(straight, rel=0.01)
    assert ahead["y"] == pytest.approx(0.0, abs=1e-3)
    assert ahead["heading"] == pytest.approx(0.0, abs=5e-3)
    assert rate(-1, -1)["x"] == pytest.approx(-straight, rel=0.01)
    about = rate(-1, 1)
    assert about["heading"] == pytest.approx(spin, rel=0.01)
    assert hypot(about["x"], about["y"]) < 2e-3
    assert rate(1, -1)["heading"] == pytest.approx(-spin, rel=0.01)
    assert rate(0, 1)["heading"] == pytest.approx(turn, rel=0.01)


def test_starts_at_its_initial_pose_and_stays(engine: Engine) -> None:
    initial = {"x": -0.12, "y": 0.2, "heading": 9.0}
    with woodbot(engine, initial=initial) as robot:
        assert dict(robot.state) == initial
        drive(robot, 0, 0, 5.0)
        assert robot.state["x"] == pytest.approx(initial["x"], abs=5e-5)
        assert robot.state["y"] == pytest.approx(initial["y"], abs=5e-5)
        assert robot.state["heading"] == pytest.approx(9.0, abs=5e-4)


def test_wheels_in_the_air_move_nothing(engine: Engine) -> None:
    robot = combine(OnBlock, engine)("r")
    robot.prepare()
    robot.open()
    for left, right in ((1, 1), (-1, 1), (0, -1)):
        drive(robot, left, right, 2.0)
        assert hypot(robot.state["x"], robot.state["y"]) < 1e-3
        assert abs(robot.state["heading"]) < 0.02
    robot.close()


@pytest.mark.parametrize(
    "torque", [0.1275, 0.002], ids=["the wheels slip", "the motors stall"]
)
def test_the_wall_stops_it(engine: Engine, torque: float) -> None:
    with woodbot(engine, parameters={"wheel_torque": torque}) as robot:
        drive(robot, 1, 1, 4.0)
        before = robot.state["x"], robot.state["y"]
        # The wheels stick out ahead and touch the round wall first.
        assert before[0] == pytest.approx(0.376, abs=0.004)
        drive(robot, 1, 1, 4.0)
        moved = hypot(robot.state["x"] - before[0], robot.state["y"] - before[1])
        assert moved < 0.004
        drive(robot, -1, -1, 1.0)
        assert robot.state["x"] < before[0] - 0.1


def test_a_weak_motor_is_slow_to_start(engine: Engine) -> None:
    def first_step(torque: float) -> float:
        with woodbot(engine, parameters={"wheel_torque": torque}) as robot:
            drive(robot, 1, 1)
            return float(robot.state["x"])

    assert first_step(0.0002) < 0.8 * first_step(0.1275)


def test_without_friction_wheels_turn_in_vain(engine: Engine) -> None:
    with woodbot(engine, parameters={"wheel_friction": 0.0}) as robot:
        drive(robot, 1, 1, 2.0)
        assert abs(robot.state["x"]) < 1e-3


def test_the_heading_goes_on_past_a_full_turn(engine: Engine) -> None:
    with woodbot(engine, initial={"heading": 100.0}) as robot:
        top = robot.parameters.max_wheel_speed
        robot.command = {"wheel/left": top, "wheel/right": -top}
        robot.drive(robot.command, 6.0)  # in one step: more than two turns
        assert robot.state["heading"] == pytest.approx(100 - 6 * 2.593, rel=0.01)


@pytest.mark.parametrize("initial", [(0, 0, 0), (0.1, -0.05, 2.0), (-0.2, 0.1, -0.7)])
def test_sensors_agree_with_the_mathematics(
    engine: Engine, initial: tuple[float, float, float]
) -> None:
    pose = dict(zip(("x", "y", "heading"), map(float, initial), strict=True))
    with woodbot(engine, initial=pose) as robot:
        assert isinstance(robot, Woodbot)
        expected = robot.measure(robot.state, robot.command)
        for path, value in expected.items():
            assert robot.sensors[path] == pytest.approx(value, abs=1.5e-3), path
        drive(robot, -0.5, 0.5, 1.0)
        expected = robot.measure(robot.state, robot.command)
        assert robot.sensors["gyro/z"] == pytest.approx(expected["gyro/z"], rel=0.02)
        assert robot.sensors["compass/x"] == pytest.approx(
            expected["compass/x"], abs=1e-3
        )


def test_on_an_open_floor_the_lidars_see_their_reach(engine: Engine) -> None:
    with woodbot(engine, parameters={"arena_radius": 0}) as robot:
        assert robot.sensors["lidar/front"] == robot.parameters.lidar_reach
        assert robot.sensors["lidar/right"] == robot.parameters.lidar_reach


def test_two_runs_are_the_same_to_the_last_bit(engine: Engine) -> None:
    def run(robot: Robot, other: Robot | None) -> list[bytes]:
        seen = [bits(robot)]
        for i in range(30):
            drive(robot, 1 - 0.05 * i, 0.03 * i - 0.2)
            if other is not None:
                drive(other, 1, -0.3)
            seen.append(bits(robot))
        return seen

    with woodbot(engine) as robot:
        alone = run(robot, None)
        robot.reset()
        again = run(robot, None)
    with woodbot(engine) as robot, woodbot(engine) as other:
        beside = run(robot, other)
    assert len(set(alone)) == 31
    assert alone == again == beside


@pytest.mark.parametrize("dt", [0.0004, 0.0123, 0.099, 0.1])
def test_any_step_of_the_clock_is_cut_into_equal_steps(
    engine: Engine, dt: float
) -> None:
    with woodbot(engine, parameters={"arena_radius": 0}) as robot:
        top = robot.parameters.max_wheel_speed
        robot.command = {"wheel/left": top, "wheel/right": top}
        count = round(1.0 / dt)
        for _ in range(count):
            robot.drive(robot.command, dt)
        robot.sense()
        # At first the wheels slip: friction needs 25 ms to bring it up to speed.
        assert robot.state["x"] == pytest.approx(0.146 * (count * dt - 0.015), rel=0.01)


def test_coarser_physics_is_still_physics(engine: Engine) -> None:
    found = rates(engine, 1, 1, options={"physics_step": "4 ms"})
    assert found["x"] == pytest.approx(0.146, rel=0.02)


def test_where_it_drives_is_the_definitions_to_say(engine: Engine) -> None:
    class Small(Woodbot):
        def arena(self) -> Arena:
            return Arena(radius=0.2)

    robot = combine(Small, engine)("r")
    robot.prepare()
    robot.open()
    drive(robot, 1, 1, 3.0)
    assert 0.15 < robot.state["x"] < 0.2
    robot.close()


class Vacuum(Definition):
    """Another robot altogether: round, 3.6 kg, wheels of two parts, two casters."""

    command = In(
        Schema(
            "vacuum.command",
            {side: angular_velocity(range=(-20, 20)) for side in ("left", "right")},
        )
    )
    state = Out(Woodbot.state)

    def body(self) -> Body:
        hub = Part(Cylinder(0.02, 0.03, axis=(0, 1, 0)), 0.1, friction=None)
        tyre = Part(Cylinder(0.036, 0.004, axis=(0, 1, 0)), 0.05, friction=0.9)
        wheels = [
            Hinge(
                side,
                (hub, tyre),
                (0.0, y, 0.0),
                (0.0, 1.0, 0.0),
                torque=0.5,
                droop=0.5,
                armature=1e-4,
            )
            for side, y in (("left", 0.1175), ("right", -0.1175))
        ]
        casters = [
            Part(Sphere(0.01), 0.05, (x, 0.0, -0.026), friction=0.0)
            for x in (0.13, -0.13)
        ]
        shell = Part(Cylinder(0.17, 0.05), 3.2, (0.0, 0.0, 0.02), friction=0.3)
        return Body((shell, *casters), tuple(wheels), height=0.036)


def test_another_robot_by_the_same_words(engine: Engine) -> None:
    robot = combine(Vacuum, engine)("v", initial={"heading": "90 deg"})
    robot.prepare()
    robot.open()

    def go(left: float, right: float) -> dict[str, float]:
        robot.reset()
        robot.command = {"left": left, "right": right}
        robot.drive(robot.command, 1.0)
        robot.sense()
        before = dict(robot.state)
        robot.drive(robot.command, 1.0)
        robot.sense()
        return {path: robot.state[path] - before[path] for path in before}

    assert go(5, 5)["y"] == pytest.approx(0.036 * 5, rel=0.02)
    assert go(-5, 5)["heading"] == pytest.approx(0.036 * 10 / 0.235, rel=0.02)
    assert go(0, 0) == pytest.approx({"x": 0, "y": 0, "heading": 0}, abs=1e-4)
    robot.close()


def test_a_definition_without_body_is_told_what_to_write(engine: Engine) -> None:
    class Ghost(Definition):
        command, state = Woodbot.command, Woodbot.state
        parameters = Woodbot.parameters

    expected = rf"Ghost has no body\(\).*{engine.__name__}"
    with pytest.raises(SchemaError, match=expected) as why:
        combine(Ghost, engine)("g").prepare()
    assert "def body(self):" in str(why.value)


def test_a_body_that_speaks_of_unknown_fields_is_refused(engine: Engine) -> None:
    class Confused(Woodbot):
        def body(self) -> Body:
            body = super().body()
            return replace(body, joints=(replace(body.joints[0], command="wheel/up"),))

    with pytest.raises(SchemaError, match=r"'wheel/up' of command\. woodbot\.command"):
        combine(Confused, engine)("c").prepare()


def test_units_other_than_physics_own_are_refused(engine: Engine) -> None:
    class Metric(Woodbot):
        state = Out(
            Schema("s", {"x": length("cm"), "y": length("cm"), "heading": angle()})
        )

    with pytest.raises(SchemaError, match=r"physics needs state 'x' in 'm'.*'cm'"):
        combine(Metric, engine)("m").prepare()


def test_a_simulation_that_runs_away_is_an_error(
    engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo would leave a note of it
    with woodbot(engine) as robot:
        instance: Any = vars(robot)["_member"].instance
        if engine is Mujoco:
            instance._data.qvel[0] = float("nan")
        else:
            number = instance._robot
            instance._call("resetBaseVelocity", number, (float("nan"), 0, 0))
        with pytest.raises((FloatingPointError, FieldValueError)):
            drive(robot, 1, 1, 0.3)
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_driving_before_open_says_so(engine: Engine) -> None:
    robot = combine(Woodbot, engine)("early")
    robot.prepare()
    with pytest.raises(AgentError, match=r"robot/early: .*open\(\)"):
        robot.drive(robot.command, 0.1)
    robot.close()


def test_a_library_that_is_not_installed_is_named(
    engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rems_net.libraries.find_spec", lambda name: None)
    name = engine.__name__.lower()
    with pytest.raises(MissingPartError) as caught:
        combine(Woodbot, engine)("r").prepare()
    missing = (
        f"This needs the library {name}, which is not installed. Type: "
        f'pip install "rems-net[{name}]"'
    )
    assert str(caught.value) == f"{no_wheels(name) or missing} (R0301)"


def test_a_library_that_cannot_be_loaded_says_why(
    engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(name: str) -> None:
        raise ImportError(f"lib{name}.so: cannot open shared object file")

    robot = combine(Woodbot, engine)("r")
    robot.prepare()
    monkeypatch.setattr("rems_net.libraries.import_module", broken)
    with pytest.raises(MissingPartError, match=r"cannot be loaded: lib\w+\.so: cannot"):
        robot.open()
    robot.close()


QUIET = """
import sys
from rems_net.agents.robot import combine
from rems_net.drivers.physics.{name} import {driver}
from rems_net.robots.woodbot import Woodbot
robot = combine(Woodbot, {driver})("r")
robot.prepare()
assert {name!r} not in sys.modules, "prepare() loads the library"
robot.open()
robot.drive(robot.command, 0.1)
robot.close()
"""


def test_nothing_is_loaded_early_and_nothing_is_printed(engine: Engine) -> None:
    program = QUIET.format(name=engine.__name__.lower(), driver=engine.__name__)
    done = finished([sys.executable, "-W", "error", "-c", program])
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_full_turn_brings_it_back(engine: Engine) -> None:
    with woodbot(engine) as robot:
        drive(robot, -1, 1, 1.0)
        while robot.state["heading"] < 2 * pi:
            drive(robot, -1, 1)
        assert hypot(robot.state["x"], robot.state["y"]) < 5e-3

"""The driver of Webots, against a stand-in of Webots' module: not Webots itself."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from rems_net import Definition, Experiment, In, Out, Schema
from rems_net.agents.robot import combine
from rems_net.bodies.devices import Devices, Motor, Reading
from rems_net.defdict import angle
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.webots.webots import Webots
from rems_net.errors import AgentError
from rems_net.robots.create2 import Create2
from rems_net.robots.epuck import Epuck
from rems_net.robots.pioneer import Pioneer3DX
from rems_net.robots.woodbot import Woodbot
from rems_net.robots.youbot import Youbot, YoubotArm
from rems_net.testing import check_robot
from tests.drivers.webots.conftest import World
from tests.drivers.webots.models import (
    CREATE,
    EPUCK,
    MODELS,
    PIONEER_3DX,
    WOODBOT,
    YOUBOT,
    spec,
)

FINE = {"integrator": "rk4", "substeps": 10}
START = {"x": 0.05, "y": -0.03, "heading": 2.0}


def opened(definition: type[Definition] = Woodbot, **more: Any) -> Any:
    robot: Any = combine(definition, Webots)("w", **more)
    robot.prepare()
    try:
        robot.open()
    except BaseException:
        robot.close()
        raise
    return robot


def drive(robot: Any, left: float, right: float, ticks: int) -> None:
    """Shares of full speed, of the wheels on either side."""
    command = {
        "wheel/left": left,
        "wheel/right": right,
        "linear/x": (left + right) / 2,
        "angular/z": (right - left) / 2,
    }
    for path, field in robot.command.schema.rows():
        robot.command[path] = field.limits[1] * command.get(path, 0.0)
    for _ in range(ticks):
        robot.drive(robot.command, 0.1)
        robot.sense()


def course(robot: Any) -> None:
    """More than a turn on the spot, and a curve."""
    drive(robot, -0.5, 0.5, 60)
    drive(robot, 0.3, 0.2, 10)


@pytest.mark.parametrize(
    ("definition", "model"), MODELS, ids=lambda one: getattr(one, "__name__", "")
)
def test_it_drives_as_the_mathematics_say(
    world: World, definition: type[Definition], model: dict[str, Any]
) -> None:
    world(model)
    robot = opened(definition, initial=START)
    kinematic: Any = combine(definition, Kinematic)("k", initial=START, options=FINE)
    kinematic.prepare()
    assert robot.state.to_dict() == kinematic.state.to_dict(), "t = 0"
    for one in (robot, kinematic):
        course(one)
    for path in robot.state.schema.paths:
        assert robot.state[path] == pytest.approx(kinematic.state[path], abs=1e-3), path
    robot.close()


@pytest.mark.parametrize(
    ("definition", "model"),
    # A Youbot has the last of MODELS as its base.
    [
        MODELS[0],
        *(pytest.param(*one, marks=pytest.mark.slow) for one in MODELS[1:-1]),
        (Youbot, YOUBOT),
        pytest.param(YoubotArm, YOUBOT, marks=pytest.mark.slow),
    ],
    ids=lambda one: getattr(one, "__name__", ""),
)
def test_it_does_what_every_robot_must(
    world: World, definition: type[Definition], model: dict[str, Any]
) -> None:
    world(model)
    report = check_robot(definition, Webots, alone=True)
    skipped = {one.name: one.skipped for one in report.outcomes if one.skipped}
    assert skipped == {"shares": "a process can hold one of it"}


def test_the_woodbots_sensors(world: World) -> None:
    """mm become m, the compass' third axis points to the right, axes that are off."""
    world(WOODBOT)
    robot = opened(initial=START)
    kinematic: Any = combine(Woodbot, Kinematic)("k", initial=START, options=FINE)
    kinematic.prepare()
    for one in (robot, kinematic):
        drive(one, 0.2, 0.4, 10)
    for path in Woodbot.sensors.schema.paths:
        expected = pytest.approx(kinematic.sensors[path], abs=1e-3)
        assert robot.sensors[path] == expected, path
    robot.close()


def test_other_sensors(world: World) -> None:
    """A switch above its threshold, a table, a count that falls with the distance."""
    world(CREATE)
    robot = opened(Create2)
    drive(robot, 0.1, 0.1, 2)
    assert robot.sensors["bumper/left"] is True
    assert robot.sensors["bumper/right"] is False
    assert robot.sensors["cliff/left"] is True
    assert robot.sensors["cliff/right"] is False
    turned = 0.1 * robot.parameters.max_wheel_speed * 0.2
    assert robot.sensors["encoder/left"] == pytest.approx(turned)
    robot.close()
    world(EPUCK)
    robot = opened(Epuck)
    drive(robot, 0.1, 0.1, 1)
    # 270.5 lies between 384 at 20 mm and 235 at 30 mm.
    expected = 0.02 + 0.01 * (384 - 270.5) / (384 - 235)
    assert robot.sensors["proximity/0"] == pytest.approx(expected)
    robot.close()
    world(PIONEER_3DX)
    robot = opened(Pioneer3DX)
    drive(robot, 0.1, 0.1, 1)
    assert robot.sensors["sonar/15"] == pytest.approx(2.5)
    robot.close()


def test_a_reset_is_the_same_again(world: World) -> None:
    """It takes no step, which would wait for other robots of the world."""
    world(WOODBOT)
    robot = opened(initial=START)
    seen = []
    for _ in range(2):
        course(robot)
        seen.append(robot.state.to_array().tolist())
        time = robot._robot.getTime()
        robot.reset()
        assert robot.state.to_dict() == START
        assert robot._robot.getTime() == time
    assert seen[0] == pytest.approx(seen[1], abs=1e-9)
    robot.close()


def test_a_world_whose_steps_do_not_fit(world: World) -> None:
    """0.1 s of 3 ms: never more than half a step away."""
    world(WOODBOT, step=3)
    robot = opened()
    begun = robot._robot.getTime()
    for tick in range(1, 31):
        drive(robot, 0.1, 0.1, 1)
        assert abs(robot._robot.getTime() - begun - 0.1 * tick) < 0.0016
    robot.close()


def test_at_the_end_it_stands(world: World) -> None:
    world(WOODBOT)
    robot = opened()
    drive(robot, 1.0, 1.0, 1)
    there = robot._robot
    robot.close()
    assert [motor.velocity for motor in there.motors.values()] == [0.0, 0.0]


def test_one_after_the_other_in_a_process(world: World) -> None:
    world(WOODBOT)
    for _ in range(2):
        robot = opened(options={"robot": "woodbot"})
        drive(robot, 0.1, 0.1, 1)
        robot.close()
    with pytest.raises(AgentError, match="this process holds the robot 'woodbot' of"):
        opened(options={"robot": "other"})


class Arm(Definition):
    """Two joints that are told where to go."""

    command = In(Schema("arm.command", {"a": angle(range=(-1, 1)), "b": angle()}))
    state = Out(Schema("arm.state", {"a": angle(), "b": angle()}))

    def webots(self) -> Devices:
        # b lies the other way round there, and is at zero where Webots says 1.
        return Devices(
            motors=(Motor("arm1", "a"), Motor("arm2", "b", factor=-1.0, offset=1.0)),
            readings=(
                Reading("a", "arm1sensor", port="state"),
                Reading("b", "arm2sensor", factor=-1.0, offset=1.0, port="state"),
            ),
        )


def test_joints_go_where_they_are_told(world: World) -> None:
    arm = {
        "name": "youBot",
        "radius": 0.05,
        "track": 0.3,
        "left": [],
        "right": [],
        "places": ["arm1", "arm2"],
        "sensors": {f"arm{i}sensor": {"angle": f"arm{i}"} for i in (1, 2)},
    }
    world(arm)
    robot = opened(Arm)
    assert robot.state.to_dict() == {"a": 0.0, "b": 0.0}
    robot.command = {"a": 0.5, "b": -0.25}
    robot.drive(robot.command, 1.0)
    robot.sense()
    assert robot.state.to_dict() == pytest.approx({"a": 0.5, "b": -0.25})
    robot.close()


def test_a_youbot(world: World, capsys: pytest.CaptureFixture[str]) -> None:
    """Its arm goes to where it starts, goes at the pace that it is told, or holds."""
    world(YOUBOT)
    start = {"arm/joint/2": 1.0, "arm/joint/3": -2.0}
    robot = opened(Youbot, initial={"x": 1.0} | start)
    assert robot._robot.motors["arm2"].angle == pytest.approx(-1.0)
    said = capsys.readouterr().err
    assert "arm/joint/3 starts at -1.57, not at -2: it had 1 s to get there" in said
    assert "arm/joint/2 starts" not in said
    robot.command = {"linear/x": 0.05, "linear/y": 0.05}
    robot.command = {"arm/joint/2": 0.0, "arm/speed": 0.5}
    robot.drive(robot.command, 0.2)
    robot.sense()
    top = robot.parameters.joint_speed
    assert robot.state["arm/joint/2"] == pytest.approx(1.0 - 0.1 * top)
    # As far ahead as to the left: two wheels on a diagonal do all of it.
    assert robot.state["wheel/front/right"] == pytest.approx(0.4)
    assert robot.state["wheel/front/left"] == pytest.approx(0.0)
    assert robot.state["x"] - 1.0 == pytest.approx(0.01, abs=1e-4)
    assert robot.state["y"] == pytest.approx(0.01, abs=1e-4)
    before = robot.state["arm/joint/2"]
    robot.drive(robot.command.schema(), 0.2)
    robot.sense()
    assert robot.state["arm/joint/2"] == before
    robot.reset()
    assert robot.state["x"] == 1.0
    assert robot.state["arm/joint/2"] == pytest.approx(1.0)
    robot.command = {"linear/x": 0.05, "linear/y": -0.05}
    robot.drive(robot.command, 0.2)
    assert robot._robot.motors["wheel2"].angle == pytest.approx(0.4), "after a reset"
    robot.close()


def test_a_run(world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each in a process of its own, which reaches the robot by its name."""
    world(WOODBOT)
    lying = {"parents": [{"rotation": [1, 0, 0, 1.57]}]}
    monkeypatch.setenv(
        "REMS_STANDIN",
        json.dumps([spec(WOODBOT), spec(WOODBOT, name="nested", **lying)]),
    )
    (tmp_path / "keys.csv").write_text(
        "time [s],command/wheel/left [percent],command/wheel/right [percent]\n"
        "0.5,50,50\n"
    )
    lab = Experiment("lab", dt="0.1 s", duration="0.5 s")
    lab.input("keys", "csv", options={"file": str(tmp_path / "keys.csv")})
    names = {"sim": "woodbot", "other": "nested"}
    for agent, name in names.items():
        options = {"robot": name}
        lab.robot(agent, "woodbot", "webots", command="input/keys", options=options)
    lab.output("log", "csv")
    lab.plans["input/keys"].host = lab.plans["output/log"].host = "rest"
    lab.run(out=tmp_path / "out")
    for agent in names:
        with (tmp_path / "out" / f"{agent}.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        assert len(rows) == 5
        x = float(rows[-1]["state/x [m]"])
        assert x == pytest.approx(0.5 * 7.3 * 0.02 * 0.5)

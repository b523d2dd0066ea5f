"""Actuation: lag, delay, dead band and gain of motors, alike in every driver."""

from math import exp
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net import Experiment, Woodbot
from rems_net.bodies.actuators import Actuators, followed
from rems_net.errors import FieldValueError

#: a motor as of a real robot
SLOW = {
    "actuation/lag": "90 ms",
    "actuation/delay": "60 ms",
    "actuation/dead_band": 0.1,
    "actuation/gain/wheel/left": 0.9,
}
TURNS = ((3.0, 5.0), (5.0, 2.0), (-2.0, -4.0), (0.2, 4.0))


def went(
    folder: Path, driver: str, settings: dict[str, Any], count: int = 1
) -> list[dict[str, float]]:
    """Return the robot's state after each step of a drive in curves."""
    lab = Experiment("lab", dt="50 ms", duration="10 s")
    for n in range(count):
        lab.robot(f"r{n}", Woodbot, driver, parameters=settings)
    way = []
    with lab.engine(folder) as engine:
        for left, right in TURNS:
            for _ in range(8):
                for n in range(count):
                    wheels = {"wheel": {"left": left, "right": right}}
                    engine.put(f"robot/r{n}/command", wheels)
                engine.step()
                way.append(dict(engine["r0"].state.flat()))
    return way


def motors(**settings: Any) -> Actuators:
    robot = Woodbot("r", parameters={f"actuation/{k}": v for k, v in settings.items()})
    robot.prepare()
    found = Actuators.of(robot.parameters, robot.command)
    assert found is not None
    return found


def test_motors_do_at_once_what_is_commanded_if_nothing_else_is_stated() -> None:
    robot = Woodbot("r")
    robot.prepare()
    assert Actuators.of(robot.parameters, robot.command) is None
    assert robot.acting(0.1) is robot.command


def test_a_step_is_followed_after_the_delay_by_the_lag() -> None:
    found = motors(lag=0.09, delay=0.06)
    robot = Woodbot("r")
    robot.prepare()
    robot.command = {"wheel": {"left": 4.0, "right": -4.0}}
    ways, dt = 0.0, 0.02
    for n in range(1, 40):
        acts = found.acting(robot.command, dt)
        ways += dt * acts["wheel/left"]
        assert acts["wheel/right"] == -acts["wheel/left"]
        after = max(0.0, n * dt - 0.06)
        expected = 4.0 * (after - 0.09 * (1 - exp(-after / 0.09)))
        assert ways == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("dt", "rel"), [(0.01, 1e-9), (0.1, 1e-9)])
def test_the_way_does_not_depend_on_the_tick(dt: float, rel: float) -> None:
    """The delay is no multiple of a tick."""
    found = motors(lag=0.07, delay=0.033)
    robot = Woodbot("r")
    robot.prepare()
    way = 0.0
    for n in range(round(1.2 / dt)):
        speed = 5.0 if n * dt < 0.4 - 1e-9 else -2.0
        robot.command = {"wheel": {"left": speed, "right": 0.0}}
        way += dt * found.acting(robot.command, dt)["wheel/left"]
    first, then = 1.2 - 0.033, 0.8 - 0.033
    gone = 5.0 * (first - 0.07 * (1 - exp(-first / 0.07)))
    gone -= 7.0 * (then - 0.07 * (1 - exp(-then / 0.07)))
    assert way == pytest.approx(gone, rel=rel)


def test_a_motor_stands_in_its_dead_band_and_keeps_its_full_speed() -> None:
    found = motors(dead_band=0.1)
    robot = Woodbot("r")
    robot.prepare()
    top = robot.parameters.max_wheel_speed
    robot.command = {"wheel": {"left": 0.1 * top, "right": top}}
    acts = found.acting(robot.command, 0.05)
    assert acts["wheel/left"] == 0.0
    assert acts["wheel/right"] == pytest.approx(top)


def test_a_strong_motor_exceeds_its_command() -> None:
    found = motors(**{"gain/wheel/right": 1.2})
    robot = Woodbot("r")
    robot.prepare()
    top = robot.parameters.max_wheel_speed
    robot.command = {"wheel": {"left": top, "right": top}}
    acts = found.acting(robot.command, 0.05)
    assert (acts["wheel/left"], acts["wheel/right"]) == pytest.approx((top, 1.2 * top))


def test_without_a_lag_the_speed_is_there_at_once() -> None:
    assert followed(1.0, 3.0, 0.0, 0.1) == (3.0, pytest.approx(0.3))
    speeds, ways = followed(np.ones(2), 3.0, np.array([0.0, 1e9]), 0.1)
    assert speeds == pytest.approx([3.0, 1.0], abs=1e-6)
    assert ways == pytest.approx([0.3, 0.1], abs=1e-6)


def test_a_wrong_lag_is_refused() -> None:
    with pytest.raises(FieldValueError, match="expects a number in s from 0 to 2"):
        Woodbot("r", parameters={"actuation/lag": "90 s"})


@pytest.mark.parametrize("driver", ["mujoco", "pybullet"])
def test_a_simulator_obeys_it_as_the_model_does(tmp_path: Path, driver: str) -> None:
    pytest.importorskip(driver)
    model = went(tmp_path / "model", "kinematic", SLOW)
    there = went(tmp_path / "there", driver, SLOW)
    plain = went(tmp_path / "plain", "kinematic", {})
    for path in ("x", "y", "heading"):
        values = [one[path] for one in model]
        scale = max(values) - min(values)
        off = max(abs(a[path] - b[path]) for a, b in zip(model, there, strict=True))
        apart = max(abs(a[path] - b[path]) for a, b in zip(model, plain, strict=True))
        assert off <= 0.05 * scale < apart


def test_a_swarm_obeys_it_to_the_last_bit(tmp_path: Path) -> None:
    alone = went(tmp_path / "alone", "kinematic", SLOW)
    among = went(tmp_path / "among", "kinematic", SLOW, count=3)
    assert alone == among


def test_motors_rest_again_after_a_reset(tmp_path: Path) -> None:
    lab = Experiment("lab", dt="50 ms", duration="10 s")
    lab.robot("r", Woodbot, "kinematic", parameters=SLOW)
    ways = []
    with lab.engine(tmp_path) as engine:
        for _ in range(2):
            engine.put("robot/r/command", {"wheel": {"left": 3.0, "right": 2.0}})
            engine.step(6)
            ways.append(dict(engine["r"].state.flat()))
            engine["r"].reset()
    assert ways[0] == ways[1]

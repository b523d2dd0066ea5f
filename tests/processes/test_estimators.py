"""Estimators: as sure as they should be, around the circle, and in the user's units."""

from __future__ import annotations

from math import pi, remainder, tau
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rems_net
from rems_net import (
    DefDict,
    Definition,
    Experiment,
    In,
    Input,
    Out,
    Schema,
    Tick,
    Woodbot,
    atan2,
    cos,
    sin,
)
from rems_net.bodies import Noise
from rems_net.cli import main
from rems_net.errors import AgentError, ExperimentError
from rems_net.events import Event, listening
from rems_net.units import angle, angular_velocity, length, velocity
from tests.pages import blocks

KINDS = ("ekf", "ukf")
SLIP = 0.03
#: Ticks of a run, and between two looks at it.
TICKS, EVERY = 60, 10


class Keys(Input):
    """Speeds of the wheels, and how fast these really turn."""

    value = Out(Woodbot.command)
    slipped = Out(Woodbot.command)

    def read(self, tick: Tick) -> None:
        if tick.n % 7 == 1:
            sides = ("wheel/left", "wheel/right")
            self.speeds = {side: self.random.uniform(-4.4, 4.4) for side in sides}
        self.value = self.speeds
        self.slipped = {
            side: speed * (1 + self.random.gauss(0, SLIP))
            for side, speed in self.speeds.items()
        }


def nees(kind: str, seed: int) -> list[float]:
    """Return squared errors by the stated covariance, per dimension, in one run."""
    lab = Experiment("lab", dt=0.1, seed=seed)
    lab.input("keys", Keys)
    noise = {"noise": True}
    lab.robot("sim", Woodbot, "kinematic", command="input/keys/slipped", options=noise)
    words = {"command": "input/keys/value", "sensors": "robot/sim/sensors"}
    options = {"definition": "woodbot", "slip": SLIP}
    lab.process("it", kind, options=options, **words)
    found = []
    with lab.engine() as engine:
        for _ in range(TICKS // EVERY):
            engine.step(EVERY)
            it, robot = engine["process/it"], engine["robot/sim"]
            off = it.state.to_array() - robot.state.to_array()
            found.append(float(off @ np.linalg.solve(covariance(it), off)) / len(off))
    return found


def covariance(it: Any) -> Any:
    size = len(it.state.to_array())
    upper = np.zeros((size, size))
    upper[np.triu_indices(size)] = it.covariance.to_array()
    return upper + upper.T - np.diag(np.diag(upper))


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_as_sure_as_it_should_be(kind: str) -> None:
    """The mean of 20 runs of six looks deviates by about 0.11."""
    assert 0.7 < np.mean([nees(kind, seed) for seed in range(20)]) < 1.35


@pytest.mark.slow  # 1000 runs
@pytest.mark.timeout(900)
@pytest.mark.parametrize("kind", KINDS)
def test_it_is_as_sure_as_it_should_be_in_1000_runs(kind: str) -> None:
    found = np.array([nees(kind, seed) for seed in range(1000)])
    assert 0.8 < found.mean() < 1.25
    assert ((found.mean(axis=0) > 0.8) & (found.mean(axis=0) < 1.25)).all()


class Cart(Definition):
    """A cart in mm and degrees whose sensors' angles jump at half a turn."""

    command = In(Schema("c", {"speed": velocity(), "turn": angular_velocity()}))
    state = Out(
        Schema("s", {"x": length("m"), "y": length("m"), "heading": angle("rad")})
    )
    sensors = Out(
        Schema(
            "r",
            {
                "course": angle("rad", range=(-pi, pi)),
                "east": length("mm"),
                "north": length("mm"),
                "loose": length("m"),
            },
        )
    )

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        v, heading = command["speed"], state["heading"]
        rates = {"x": v * cos(heading), "y": v * sin(heading)}
        return rates | {"heading": command["turn"]}

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        heading = state["heading"]
        course = atan2(sin(heading), cos(heading))
        east, north = 1000 * state["x"], 1000 * state["y"]
        return {"course": course, "east": east, "north": north, "loose": 1.0}

    def noise(self) -> dict[str, Noise]:
        angles = {"course": Noise(absolute=0.02)}
        return angles | {"east": Noise(absolute=5), "north": Noise(absolute=5)}


class Branching(Cart):
    """The same with an `if`, which arrays do not take."""

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        if command["speed"] > 0:
            return super().derivative(state, command)
        return dict.fromkeys(("x", "y", "heading"), 0.0)


class Round(Input):
    value = Out(Cart.command)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"speed": 0.3, "turn": 0.9}


def carted(kind: str, definition: type, ticks: int = 150, **options: Any) -> Any:
    """Return a robot that has gone in circles, and the estimator's values."""
    lab = Experiment("lab", dt=0.1, seed=3)
    lab.input("round", Round)
    lab.robot("cart", Cart, "kinematic", command="input/round", options={"noise": True})
    name = f"{__name__}:{definition.__name__}"
    words = {"command": "robot/cart/command", "sensors": "robot/cart/sensors"}
    lab.process("it", kind, options={"definition": name, **options}, **words)
    with lab.engine() as engine:
        rows = []
        for _ in range(ticks):
            engine.step()
            it, cart = engine["process/it"], engine["robot/cart"]
            rows.append(it.state.to_array() - cart.state.to_array())
        return np.array(rows), it


@pytest.mark.parametrize("kind", KINDS)
def test_angles_go_around(kind: str) -> None:
    """Two turns, from a start that is wrong by nearly half a turn."""
    unsure = "heading = 1.5, x = '100 mm', y = 0.1"
    off, it = carted(kind, Cart, initial="heading = 3.0", unsure=unsure)
    turned = [remainder(value, tau) for value in off[20:, 2]]
    assert max(map(abs, turned)) < 0.08
    assert np.abs(off[20:, :2]).max() < 0.05
    assert abs(it.state.heading) > 2 * tau  # as the definition has it: not wrapped
    assert 0.0 < it.deviation.heading < 0.02
    assert it.covariance.schema["x/heading"].unit == "m*rad"
    assert it.covariance.schema["x/x"].unit == "m**2"


@pytest.mark.parametrize("kind", KINDS)
def test_a_definition_with_an_if(kind: str) -> None:
    """It is computed point by point, with the same bits."""
    at_once, _ = carted(kind, Cart, 20)
    one_by_one, _ = carted(kind, Branching, 20)
    assert at_once.tolist() == one_by_one.tolist()


class Wrapped(Cart):
    """The same with a heading that has a range of one turn."""

    state = Out(
        Schema("s", {"x": length(), "y": length(), "heading": angle(range=(-pi, pi))})
    )


def test_an_angle_with_a_range_of_one_turn_stays_in_it() -> None:
    off, it = carted("ekf", Wrapped, 60)
    assert -pi <= it.state.heading <= pi
    assert max(abs(remainder(value, tau)) for value in off[:, 2]) < 0.08


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({}, "it needs the definition of the robot that it reads"),
        ({"definition": "woodbot", "drift": "z = 1"}, "drift names 'z', and woodbot"),
        ({"definition": "woodbot", "unsure": "x 1"}, "unsure = 'x 1' cannot be read"),
        ({"definition": "woodbot", "noise": "gyro = 1"}, "noise names 'gyro'"),
        ({"definition": "woodbot", "initial": "x = '1 s'"}, "initial of 'x'"),
        ({"definition": "woodbot", "drift": {"x": 1}}, "Write it as text in quotes"),
    ],
)
def test_what_is_missing_is_named(options: dict[str, str], says: str) -> None:
    lab = Experiment("lab")
    lab.robot("sim", "woodbot", "kinematic")
    words = {"command": "robot/sim/command", "sensors": "robot/sim/sensors"}
    lab.process("it", "ukf", options=options, **words)
    with pytest.raises(ValueError, match=says):
        lab.check()


@pytest.mark.parametrize(
    ("port", "says"),
    [
        ("command", "it reads woodbot.state as its command, which has no 'wheel'; con"),
        ("sensors", "it reads woodbot.state as its sensors, which has no 'lidar/front"),
    ],
)
def test_ports_that_are_mixed_up(port: str, says: str) -> None:
    lab = Experiment("lab", duration=1.0)
    lab.robot("sim", "woodbot", "kinematic")
    words = {"command": "robot/sim/command", "sensors": "robot/sim/sensors"}
    words[port] = "robot/sim/state"
    lab.process("it", "ekf", options={"definition": "woodbot"}, **words)
    with pytest.raises(AgentError, match=says), lab.engine():
        pass


@pytest.mark.parametrize(
    ("initial", "options", "says"),
    [
        ({}, {"initial": "heading = 90"}, ["14.3 turns", "and robot/sim at 0"]),
        ({"x": 0.1}, {}, ["begins at x = 0, and robot/sim at 0.1; write such as opt"]),
        ({"x": 0.1}, {"initial": 'x = "10 cm"'}, []),
        ({"x": 0.1}, {"unsure": 'x = "10 cm"'}, []),
    ],
)
def test_a_start_that_is_elsewhere(
    initial: dict[str, Any], options: dict[str, Any], says: list[str]
) -> None:
    lab = Experiment("lab", duration=1.0)
    lab.robot("sim", "woodbot", "kinematic", initial=initial)
    words = {"command": "robot/sim/command", "sensors": "robot/sim/sensors"}
    lab.process("it", "ekf", options={"definition": "woodbot", **options}, **words)
    events: list[Event] = []
    with listening(events.append):
        lab.engine()
    assert len(events) == len(says)
    assert all(s in e.text for s, e in zip(says, events, strict=True))


class Blind(Definition):
    command = In(Cart.command)
    state = Out(Cart.state)

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"x": command["speed"]}


#: definitions that state the noise of some sensors: of lidars, encoders, joints
SHIPPED = ("woodbot", "create2", "dynabot", "epuck", "pioneer3dx", "youbot_arm")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("definition", SHIPPED)
def test_robots_that_ship(definition: str, kind: str) -> None:
    """No error is beyond what it states: five deviations."""
    lab = Experiment("lab")
    lab.robot("sim", definition, "kinematic", options={"noise": True})
    words = {"command": "robot/sim/command", "sensors": "robot/sim/sensors"}
    lab.process("it", kind, options={"definition": definition}, **words)
    with lab.engine() as engine:
        sim, it = engine["robot/sim"], engine["process/it"]
        engine.put(
            "robot/sim/command",
            {path: 0.3 * one.limits[1] for path, one in sim.command.schema.rows()},
        )
        engine.step(20)
        off = np.abs(it.state.to_array() - sim.state.to_array())
        assert (off <= 5 * it.deviation.to_array() + 1e-9).all()
        assert it.deviation.to_array().max() > 1e-5


def test_a_robot_without_sensors() -> None:
    with pytest.raises(ExperimentError, match="has no sensors, so nothing corrects"):
        carted("ekf", Blind)


def test_old_readings_count_once() -> None:
    """A device that is slower than the tick reads the same again and again."""

    class Held(Input):
        value = Out(Cart.sensors)

        def read(self, tick: Tick) -> dict[str, float]:
            return {"east": 1.0 + tick.n // 50}

    lab = Experiment("lab", dt=0.1)
    lab.robot("cart", Cart, "kinematic")
    lab.input("held", Held)
    options = {"definition": f"{__name__}:Cart", "unsure": "x = 1.0"}
    words = {"command": "robot/cart/command", "sensors": "input/held"}
    lab.process("it", "ekf", options=options, **words)
    with lab.engine() as engine:
        engine.step()
        first = engine["process/it"].deviation.x
        engine.step(20)
        assert engine["process/it"].deviation.x == pytest.approx(first)
        assert first == pytest.approx(0.005, rel=0.01)


def test_the_page_is_true(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = Path(__file__).parents[2] / "docs" / "estimation.md"
    (text,) = blocks(page, "toml")
    Path("lab.toml").write_text(text)
    assert main(["run", "--direct", "lab.toml"]) == 0
    estimate = rems_net.read("runs/estimate")["process/ekf"]
    assert len(estimate.plain("covariance/x/heading")) == 10
    assert estimate.plain("deviation/x")[-1] < 0.01

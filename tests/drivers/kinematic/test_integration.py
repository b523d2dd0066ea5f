"""How rates become a step: the default, what contradicts it, and where it ends."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import exp
from typing import Any

import pytest

from rems_net import Definition, Experiment, In, Input, Out, Schema, Settings
from rems_net.agents.experiment.solo import Solo
from rems_net.defdict import DefDict, angle, length, time, velocity
from rems_net.errors import AgentError, ExperimentError
from rems_net.events import Event, listening
from rems_net.maths import sincos


class Cart(Definition):
    """It takes a while to reach its speed, and turns back at a wall, if it has one."""

    parameters = Settings(lag=time(default=0.5, range=(1e-6, 10)), wall=length())
    command = In(Schema("command", {"speed": velocity(range=(-1, 1))}))
    state = Out(Schema("state", {"x": length(), "speed": velocity()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        p = self.parameters
        if p.wall and state["x"] >= p.wall:
            return {"x": 0.0, "speed": 0.0}
        missing = command["speed"] - state["speed"]
        return {"x": state["speed"], "speed": missing / p.lag}


class Hand(Input):
    value = Out(Cart.command)

    def read(self, tick: Any) -> dict[str, float]:
        return {"speed": 0.2 if tick.t < 5 else -0.1}


@contextmanager
def stepped(
    lags: list[float], seconds: float, **robot: Any
) -> Iterator[tuple[Solo, list[str]]]:
    """Carts, and what is told of them. robot: settings of each."""
    lab = Experiment("carts", dt="0.1 s")
    lab.input("hand", Hand)
    wall = robot.pop("wall", 0.0)
    for i, lag in enumerate(lags):
        parameters = {"lag": lag, "wall": wall}
        source = "input/hand"
        lab.robot(
            f"c{i}", Cart, "kinematic", command=source, parameters=parameters, **robot
        )
    events: list[Event] = []
    with listening(events.append), lab.engine() as engine:
        told = [event.text for event in events]
        try:
            engine.run(until=seconds)
        finally:
            told += [event.text for event in events]
        yield engine, told


@pytest.mark.parametrize("lag", [0.5, 0.05])
def test_a_definition_of_ones_own_is_integrated_well(lag: float) -> None:
    with stepped([lag], 1.0) as (engine, told):
        speed = engine["robot/c0"].state["speed"]
    assert speed == pytest.approx(0.2 * (1 - exp(-1 / lag)), rel=1e-5)
    assert not told


@pytest.mark.parametrize(
    ("lag", "options", "cause"),
    [
        (0.01, {}, '0.01 s; write options = {"substeps": 20}, or dt = "0.02 s"'),
        (
            0.05,
            {"integrator": "euler"},
            "0.05 s; write options = "
            '{"integrator": "rk4", "substeps": 4}, or dt = "0.025 s"',
        ),
    ],
)
def test_a_step_that_is_too_long_is_told_once(
    lag: float, options: dict[str, Any], cause: str
) -> None:
    with stepped([lag], 9.0, options=options) as (_, told):
        pass
    (text,) = told
    assert text.startswith("robot/c0: steps of 0.")
    assert "are too long for Cart.derivative (test_integration.py, line" in text
    assert "'speed' goes " in text
    assert text.endswith(f"a time constant is about {cause}")


def test_what_the_warning_says_to_write_mends_it() -> None:
    with stepped([0.01], 9.0, options={"substeps": 20}) as (engine, told):
        speed = engine["robot/c0"].state["speed"]
    assert speed == pytest.approx(-0.1)
    assert not told


def test_a_wall_is_no_reason_to_warn() -> None:
    with stepped([0.5], 4.0, wall=0.3) as (engine, told):
        assert 0.3 <= engine["robot/c0"].state["x"] < 0.32
    assert not told


def test_the_robots_of_the_class_keep_their_steps() -> None:
    lab = Experiment("class", dt="0.1 s")
    lab.robot("bot", "woodbot", "kinematic")
    events: list[Event] = []
    with listening(events.append), lab.engine() as engine:
        engine.put("robot/bot/command", {"wheel": {"left": -2.0, "right": 7.0}})
        engine.step(5)
        bot = engine["robot/bot"]
        state, command = bot.state.schema(), bot.command
        for _ in range(5):  # Euler's own steps
            rates = bot.derivative(state, command)
            for path, rate in rates.items():
                state[path] += 0.1 * rate
        assert bot.state.encode() == state.encode()
    assert not events


def test_an_integrator_that_there_is_not_is_refused() -> None:
    class Heun(Cart):
        integrator = "heun"

    lab = Experiment("heun")
    lab.robot("c", Heun, "kinematic")
    with pytest.raises(ExperimentError, match="states integrator = 'heun'; expec"):
        lab.check()


@pytest.mark.parametrize("count", [1, 3])
def test_infinity_names_tick_line_and_cause(count: int) -> None:
    options = {"integrator": "euler"}
    with pytest.raises(AgentError) as caught:  # noqa: SIM117
        with stepped([0.01] * count, 60.0, options=options):
            pass
    assert str(caught.value).startswith("robot/c0: at tick 3")
    assert ", 'speed' of the state is infinite: steps of 0.1 s are" in str(caught.value)


@pytest.mark.parametrize("options", [{}, {"integrator": "euler"}])
def test_a_crowd_is_told_of_as_its_robots_are(options: dict[str, Any]) -> None:
    with stepped([0.01], 6.0, options=options) as (engine, alone):
        state = engine["robot/c0"].state.encode()
    with stepped([0.01] * 7, 6.0, options=options) as (engine, crowd):
        assert [engine[f"robot/c{i}"].state.encode() for i in range(7)] == 7 * [state]
    assert crowd == alone


class Unicycle(Definition):
    command = In(Schema("command", {"speed": velocity()}))
    state = Out(Schema("state", {"x": length(), "y": length(), "turned": angle()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        s, c = sincos(state["turned"])
        v = command["speed"]
        return {"x": v * c, "y": v * s, "turned": 5.0}


def test_a_circle_is_told_of_by_how_fast_it_turns() -> None:
    lab = Experiment("circle", dt="0.5 s")
    lab.robot("c", Unicycle, "kinematic", options={"integrator": "euler"})
    events: list[Event] = []
    with listening(events.append), lab.engine() as engine:
        for _ in range(3):
            engine.put("robot/c/command", {"speed": 1.0})
            engine.step()
    assert "in two halves" in events[0].text

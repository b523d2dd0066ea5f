"""An experiment as an engine, stepped by its caller."""

import sys
from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from rems_net import Experiment, Out, Process, Tick
from rems_net.agents.experiment.solo import Solo
from rems_net.errors import AgentError, ExperimentError, FieldValueError
from tests.agents.runs import in_one_host
from tests.commands import ROOT, finished
from tests.engine.parts import COMMAND, Cart, Jumper, Stick, Wave


def lab(**more: Any) -> Experiment:
    new = Experiment("lab", **({"dt": 0.1, "duration": 1.0} | more))
    new.input("wave", Wave)
    new.robot("sim", Cart, "kinematic", command="input/wave")
    new.robot("free", Cart, "kinematic")
    return new


@pytest.fixture
def engine() -> Iterator[Solo]:
    with lab().engine() as made:
        yield made


def test_it_steps_and_shows_the_agents_themselves(engine: Solo) -> None:
    engine.step(3)
    assert (engine.n, engine.t) == (3, 0.3)
    assert engine["robot/sim"].state.x > 0
    assert engine["sim"] is engine["robot/sim"]
    engine.run()
    assert engine.n == 10


def test_it_runs_until_a_time_or_until_a_condition_holds(engine: Solo) -> None:
    engine.run(until=0.4)
    assert engine.n == 4
    engine.run(until="500 ms")
    assert engine.n == 5
    with pytest.raises(FieldValueError, match="a number in s, but got 'soon'"):
        engine.run(until="soon")
    engine.run(until=lambda e: e["sim"].state.x > 0.1)
    assert 5 < engine.n < 10
    assert engine["sim"].state.x > 0.1


def test_a_reset_begins_again_with_the_same_numbers(engine: Solo) -> None:
    def path() -> list[float]:
        found = []
        for _ in range(10):
            engine.step()
            found.append(engine["sim"].state.x)
        return found

    first = path()
    engine.reset()
    assert engine.n == 0
    assert path() == first


def test_another_seed_gives_other_random_numbers() -> None:
    new = Experiment("noise", dt=0.1, duration=1.0)
    new.robot("sim", "woodbot", "kinematic", options={"noise": True})
    read = []
    with new.engine() as engine:
        for seed in (1, 2, 1):
            engine.reset(seed=seed)
            engine.step(2)
            read.append(dict(engine["sim"].sensors.flat()))
    assert read[0] == read[2] != read[1]


def test_a_caller_commands_with_units_and_the_robot_stops_by_itself(
    engine: Solo,
) -> None:
    engine.put("robot/free/command", {"speed": 0.5, "turn": 0.0})
    engine.step()
    assert engine["free"].state.x == pytest.approx(0.05)
    engine.step(9)  # the command lives half a second
    assert engine["free"].state.x == pytest.approx(0.3, abs=0.06)
    with pytest.raises(FieldValueError, match="speed"):
        engine.put("robot/free/command", {"speed": 7.0})


def test_robots_with_a_drive_of_their_own_are_not_stepped_as_arrays() -> None:
    new = Experiment("two", dt=0.1, duration=1.0)
    new.input("wave", Wave)
    for name in ("a", "b"):
        new.robot(name, Cart, Jumper, command="input/wave")
    with new.engine() as engine:
        engine.step(6)
        assert engine["a"].state.x == engine["b"].state.x > 0
        engine.step()  # the seventh puts them back
        assert engine["a"].state.x == engine["b"].state.x == 0


def test_stop_holds_until_it_is_released(engine: Solo) -> None:
    engine.step(2)
    engine.stop()
    engine.step()
    x = engine["sim"].state.x
    engine.step(2)
    assert engine["sim"].state.x == x
    engine.release()
    engine.step(2)
    assert engine["sim"].state.x > x


def test_it_records_if_asked(tmp_path: Path) -> None:
    new = lab()
    new.output("log", "csv")
    with new.engine(out=tmp_path / "rec") as engine:
        engine.run()
    names = [Path(file).name for file in engine.files]
    assert names == ["free.csv", "sim.csv", "run.mcap"]
    by_a_process = in_one_host(new).run(tmp_path / "run")
    for file in by_a_process.files:
        assert (tmp_path / "rec" / file.name).read_bytes() == file.read_bytes()


# -- mistakes ------------------------------------------------------------------------


def test_a_closed_engine_says_so() -> None:
    engine = lab().engine()
    with pytest.raises(ExperimentError, match=r"is closed; open\(\) it first"):
        engine.step()
    engine.open()
    with pytest.raises(ExperimentError, match=r"is open already"):
        engine.open()
    engine.close()
    engine.close()
    with pytest.raises(ExperimentError, match=r"is closed; open\(\) it first"):
        engine["sim"]


@pytest.mark.parametrize("how", ["fails", "is interrupted", "steps its engine"])
def test_a_tick_that_was_not_done_to_its_end(how: str) -> None:
    class Odd(Process):
        value = Out(COMMAND)

        def step(self, tick: Tick) -> None:
            if tick.n == 3 and how == "fails":
                raise ValueError("no")
            if tick.n == 3 and how == "is interrupted":
                raise KeyboardInterrupt
            if tick.n == 3:
                engines[0].step()

    new, engines = lab(), list[Solo]()
    new.process("odd", Odd)
    with new.engine() as engine:
        engines.append(engine)
        with pytest.raises((AgentError, KeyboardInterrupt)) as told:
            engine.run()
        assert how != "steps its engine" or "does not step its own" in str(told.value)
        assert (engine.n, engine["sim"].state.x > 0) == (2, True)
        with pytest.raises(ExperimentError, match=r"tick 3 was begun .* reset\(\) beg"):
            engine.step()
        engine.reset().step(2)
        assert engine.n == 2


def test_the_first_failure_is_the_one_that_is_told() -> None:
    class Twice(Process):
        value = Out(COMMAND)

        def step(self, tick: Tick) -> None:
            raise ValueError("first")

        def close(self) -> None:
            raise ValueError("second")

    new = lab()
    new.process("twice", Twice)
    with pytest.raises(AgentError, match="first"), new.engine() as engine:
        engine.step()


def test_another_thread_is_refused(engine: Solo) -> None:
    came: list[Exception] = []

    def step() -> None:
        try:
            engine.step()
        except ExperimentError as error:
            came.append(error)

    thread = Thread(target=step)
    thread.start()
    thread.join()
    assert "opened in another thread" in str(came[0])


def test_hardware_is_refused() -> None:
    new = Experiment("driven", dt=0.1, duration=1.0, pace=1)
    new.robot("bot", "create2", "create2", options={"port": "/dev/nothing"})
    with pytest.raises(ExperimentError, match="robot/bot drives a device"):
        new.engine()


def test_what_is_not_there_is_refused_with_what_is(engine: Solo) -> None:
    with pytest.raises(KeyError, match=r"no agent 'robot/sin'; there is .*'robot/sim'"):
        engine["robot/sin"]
    with pytest.raises(ExperimentError, match="reads 'input/wave' already"):
        engine.put("robot/sim/command", {})
    with pytest.raises(ExperimentError, match="can be put at: robot/free/command"):
        engine.put("robot/fre/command", {})
    for count in ("2 s", 1.5, -1, True):
        with pytest.raises(ExperimentError, match=r"a number of ticks, such as 10"):
            engine.step(count)  # type: ignore[arg-type]
    with pytest.raises(ExperimentError, match=r"a folder is text.* got 5"):
        Experiment("lab", folder=5)  # type: ignore[arg-type]


def test_an_agent_that_fails_is_named_with_its_line() -> None:
    class Wrong(Process):
        value = Out(COMMAND)

        def step(self, tick: Tick) -> None:
            self.value = {"speed": 1 / (tick.n - 3)}

    new = lab()
    new.process("wrong", Wrong)
    with new.engine() as engine, pytest.raises(AgentError) as told:
        engine.run()
    assert told.value.agent == "process/wrong"
    assert "ZeroDivisionError: division by zero (test_solo.py, line " in str(told.value)
    assert engine.n == 2


def test_without_a_duration_an_end_has_to_be_said() -> None:
    new = Experiment("long", dt=0.1)
    new.robot("sim", Cart, "kinematic")
    with new.engine() as engine:
        engine.step(5)
        engine.run(until=2.0)
        assert engine.n == 20
        with pytest.raises(ExperimentError, match="has no end: give it a duration"):
            engine.run()


@pytest.mark.parametrize(
    ("told", "why"),
    [({"pace": 1}, "pace = 1"), ({}, "has restart"), ({}, "leave on_failure")],
)
def test_what_one_process_cannot_do_is_refused(told: dict[str, Any], why: str) -> None:
    new = lab()
    if why == "has restart":
        new.robot("again", Cart, "kinematic", restart=1)
    new.on_failure = "drop" if "on_failure" in why else "stop"
    with pytest.raises(ExperimentError, match=why):
        new.run(direct=True, **told)


def test_units_of_a_command_are_converted() -> None:
    new = Experiment("stick", dt=0.1, duration=1.0)
    new.input("stick", Stick)
    new.robot("sim", Cart, "kinematic", command="input/stick")
    with new.engine() as engine:
        engine.step()
        assert 0.29 < engine["sim"].command.speed < 0.3


def test_classes_of_a_terminal_will_do() -> None:
    """Defined nowhere in a file: `python -c`, a heredoc, a notebook, a function."""
    text = """
from rems_net import *
from rems_net.defdict import *
def go():
    class Dot(Definition):
        command = In(Schema("c", {"v": velocity()}))
        state = Out(Schema("s", {"x": length()}))
        def derivative(self, state, command):
            return {"x": command["v"]}
    class One(Input):
        value = Out(Dot.command)
        def read(self, tick):
            return {"v": 1.0}
    lab = Experiment("dot", dt="100 ms", duration="1 s")
    lab.input("one", One)
    lab.robot("dot", Dot, "kinematic", command="input/one")
    with lab.engine() as engine:
        engine.run()
        print(round(engine["dot"].state["x"], 6))
go()
"""
    at_the_prompt = text.replace("\ngo()", "\n\ngo()")
    ways = ((["-c", text], ""), (["-"], text), (["-i", "-q"], at_the_prompt))
    for words, typed in ways:
        done = finished([sys.executable, "-W", "error", *words], ROOT, typed=typed)
        said = done.stderr.replace(">>> ", "").replace("... ", "").strip()
        assert (done.stdout, said) == ("1.0\n", "")

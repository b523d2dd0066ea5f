"""Verbs that processes call: at which tick, from where, and what is wrong with one."""

from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment, In, Output, Process, Verbs
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.plan import HERE
from rems_net.errors import AgentError, ExperimentError, SchemaError, uncoded
from tests.agents.runs import Told
from tests.engine.callers import (
    COMMAND,
    STATE,
    Crowd,
    Geared,
    Names,
    Referee,
    Sled,
    Wrong,
)
from tests.engine.thrice import in_three_ways

PARTS = Path(__file__).parent
NAMED = (
    r"Names names the verb 'reset' of verbs and does not call it \(callers.py, line "
    r"\d+\); write reset\(\)\."
)


def sled(**more: Any) -> Experiment:
    """An experiment of one sled, which goes on at 0.5 m/s."""
    lab = Experiment("sled", dt=0.1, duration=2.0, folder=PARTS)
    lab.robot("a", Sled, "kinematic", **more)
    return lab


def test_a_call_is_done_before_the_next_step() -> None:
    lab = sled(initial={"x": 0.28})
    lab.process("ref", Referee, sled="robot/a/state")
    with lab.engine() as engine:
        engine.step(1)
        assert engine["a"].state.x == pytest.approx(0.33)  # and so it is called
        engine.step(1)
        assert engine["a"].state.x == pytest.approx(0.01 + 0.05)
        assert engine["a"].sensors.moved == 1


def test_a_robot_that_steps_seldom_does_all_that_came_since() -> None:
    lab = sled(every=4, initial={"x": 0.5})
    lab.process("ref", Referee, sled="robot/a/state")
    with lab.engine() as engine:
        engine.step(7)
        assert engine["a"].sensors.moved == 0
        engine.step(1)  # it was called at ticks 4 to 7
        assert engine["a"].sensors.moved == 4
        assert engine["a"].state.x == pytest.approx(0.07 + 0.4 * 0.5)


def test_several_call_in_the_order_of_their_names() -> None:
    lab = sled(initial={"x": 0.5})
    for name in ("late", "early", "middle"):
        lab.process(name, Referee, sled="robot/a/state")
    with lab.engine() as engine:
        engine.step(2)
        assert engine["a"].sensors.by == "elm"


def test_robots_of_a_glob_have_their_verbs_by_key() -> None:
    lab = Experiment("sleds", dt=0.1, duration=2.0, folder=PARTS)
    for i in range(3):
        lab.robot(f"r{i}", Sled, "kinematic", initial={"x": 0.2 * i})
    lab.process("crowd", Crowd, sleds="robot/*/state")
    with lab.engine() as engine:
        engine.step(1)
        engine.step(1)
        assert [engine[f"r{i}"].state.x for i in range(3)] == pytest.approx(
            [0.1, 0.3, 0.15]
        )
        assert engine["r2"].sensors.moved == 1  # reset() came first


def test_a_verb_changes_one_of_many_alike() -> None:
    lab = Experiment("geared", dt=0.1)
    for i in range(3):
        lab.robot(f"r{i}", Geared, "kinematic")
    with lab.engine() as engine:
        engine["r1"].shift(2.0)
        engine.step(1)
        found = [engine[f"r{i}"].state.x for i in range(3)]
        assert found == pytest.approx([0.05, 0.1, 0.05])


def test_the_command_of_the_tick_is_obeyed_after_a_reset() -> None:
    lab = sled(command="process/crowd2")
    lab.process("crowd2", Referee, sled="robot/a/state", options={"most": 0.2})
    with lab.engine() as engine:
        engine.step(12)
        assert engine["a"].command.speed == 0.9
        assert engine["a"].sensors.moved > 0


LINE = "callers.py, line 99, in step, tick 3"


@pytest.mark.parametrize(
    ("what", "says"),
    [
        (
            ".putt(1)",
            "robot/a.putt(): there is no verb 'putt'; there is put, "
            "reset. Did you mean 'put'? (",
        ),
        (
            ".put()",
            "robot/a.put(): missing a required argument: 'x'; expected put(x: "
            "'float', *, by: 'str' = '') -> 'float'. (",
        ),
        (
            ".put(-1.0)",
            "robot/a.put(): ValueError: there is no floor (callers.py, line 35, in "
            "put) (",
        ),
        (
            "['robot/b'].reset()",
            "the verbs of 'robot/b' cannot be called: sled does not read it, but "
            "robot/a. Did you mean 'robot/a'? (",
        ),
        (
            ".put(object())",
            "robot/a.put() is called with what cannot travel (Object of type object "
            "is not JSON serializable); expected numbers, text, lists and dicts of "
            "them, or a DefDict. (",
        ),
        (
            ".put(__import__('unyt').unyt_quantity(10, 'cm'))",
            "robot/a.put() is called with what cannot travel (10 cm has a unit, which "
            "would be lost: type its number, in the unit that the verb takes, or a "
            "text, '10 cm'); expected numbers, text, lists and dicts of them, or a "
            "DefDict. (",
        ),
        (".put = 1", "the verb 'put' is set to 1; a verb is called: put(1) ("),
        (
            ".put(0.0, by='x' * 70000)",
            "the calls of 10 ticks take 70074 bytes, with robot/a.put(); expected "
            "at most 65536: call less often, or with less. (",
        ),
    ],
)
def test_a_wrong_call_is_the_caller_s(what: str, says: str) -> None:
    lab = sled()
    lab.process("ref", Wrong, sled="robot/a/state", options={"what": what})
    with lab.engine() as engine, pytest.raises(AgentError) as told:
        engine.step(9)
    assert told.value.agent == "process/ref"
    assert uncoded(told.value.cause) == says + LINE + ")"


def test_a_verb_that_is_only_named_is_refused() -> None:
    lab = sled()
    with pytest.raises(ExperimentError, match=NAMED):
        lab.process("ref", Names, sled="robot/a/state")


def test_the_same_bytes_in_the_engine_in_one_host_and_in_many() -> None:
    def build(host: dict[str, Any]) -> Experiment:
        lab = Experiment("calls", dt=0.1, duration=3.0, folder=PARTS)
        for i in range(3):
            lab.robot(
                f"r{i}",
                "callers.py:Sled",
                "kinematic",
                command="process/b" if i == 2 else None,
                initial={"x": 0.2 * i},
                every=i or 1,
                since=0.3 * i,
                **host,
            )
        lab.process("a", "callers.py:Referee", sled="robot/r1/state", **host)
        lab.process("b", "callers.py:Referee", sled="robot/r2/state", every=3, **host)
        lab.process(
            "c",
            "callers.py:Referee",
            sled="robot/r2/state",
            options={"most": 1.0},
            **host,
        )
        lab.process("crowd", "callers.py:Crowd", sleds="robot/*/state", **host)
        lab.output("log", "csv", **host)
        return lab

    found = in_three_ways(build, "r0.csv", "r1.csv", "r2.csv")
    assert b",b\n" in found["r2.csv"]
    assert b",a\n" in found["r1.csv"]


def test_a_robot_in_real_time_gets_calls_and_warns_of_wrong_ones(
    tmp_path: Path,
) -> None:
    lab = Experiment("free", dt=0.02, duration=2.0, folder=PARTS, record=False)
    lab.robot("a", "callers.py:Sled", "callers.py:Free", initial={"x": 0.3})
    lab.process("ref", "callers.py:Referee", sled="robot/a/state", host=HERE)
    # Late, as nobody waits for that robot: it may begin some ticks after the others.
    late = {"what": ".put()", "at": 80}
    wrong: dict[str, Any] = {"sled": "robot/a/state", "options": late, "host": HERE}
    lab.process("wrong", "callers.py:Wrong", **wrong)
    lab.output("log", "csv", host=HERE)
    told = Told()
    done = lab.run(tmp_path, show=told, pace=1)
    assert done.ticks == 100
    rows = (tmp_path / "a.csv").read_text().splitlines()
    assert "r" in rows[-1].split(",")[-1]
    warned = told.of("rejected")
    assert [text.partition("(callers")[0] for text in warned] == [
        "robot/a/@calls/process/wrong/verbs refused a call: robot/a.put(): missing a "
        "required argument: 'x'; expected put(x: 'float', *, by: 'str' = '') -> "
        "'float'. "
    ]


def test_a_wrong_call_ends_a_run_in_processes_with_the_same_sentence(
    tmp_path: Path,
) -> None:
    lab = sled()
    lab.plans.clear()
    lab.record = False
    lab.robot("a", "callers.py:Sled", "kinematic", host=HERE)
    lab.process(
        "ref", "callers.py:Wrong", sled="robot/a/state", options={"what": ".putt(1)"}
    )
    with pytest.raises(AgentError) as told:
        lab.run(tmp_path, show=Show())
    assert told.value.agent == "process/ref"
    assert told.value.cause == (
        "robot/a.putt(): there is no verb 'putt'; there is put, reset. Did you "
        f"mean 'put'? ({LINE}) (R0513)"
    )


class Own(Process):
    """Reads itself, and takes that for a robot."""

    sled = In(COMMAND)
    verbs = Verbs(sled)

    def step(self, tick: object) -> None:
        self.verbs.reset()


class Shown(Output):
    """No process."""

    sled = In(STATE)
    verbs = Verbs(sled)

    def write(self, tick: object) -> None:
        self.verbs.reset()


def test_what_is_refused_before_anything_starts() -> None:
    lab = sled()
    lab.process("own", Own, sled="process/ref/value")
    lab.process("ref", Referee, sled="robot/a/state")
    with pytest.raises(ExperimentError) as told:
        lab.check()
    assert str(told.value) == (
        "process 'own': verbs = Verbs(sled) calls the verbs of robots, and sled reads "
        "process/ref/value; connect it to a robot, such as sled='robot/sim/state'."
        " (R0424)"
    )
    lab = sled()
    lab.output("shown", Shown, sled="robot/a/state")
    with pytest.raises(ExperimentError, match=r"a process calls the verbs of robots"):
        lab.check()
    with pytest.raises(SchemaError, match=r"Verbs\('sled'\) is of no In"):
        Verbs("sled")  # type: ignore[arg-type]


def test_a_setting_of_verbs_says_what_to_write() -> None:
    lab = sled()
    lab.process("ref", Referee, sled="robot/a/state")
    with lab.engine() as engine:
        with pytest.raises(SchemaError, match=r"self\.verbs\.reset\(\)"):
            engine["ref"].verbs = {}
        with pytest.raises(SchemaError, match="called before the first tick"):
            engine["ref"].verbs.reset()

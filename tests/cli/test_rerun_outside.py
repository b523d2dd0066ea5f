"""Verbs that are called from outside, between two ticks: recorded, and called again."""

import hashlib
import json
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.about.outside import BEGIN, Outside
from rems_net.agents.experiment.again.compared import compare
from rems_net.agents.experiment.again.rebuilt import rebuild
from rems_net.client import join
from rems_net.recordings.mcap.reader import McapFile
from tests.agents.runs import in_one_host, until
from tests.cli.recorded import SAME
from tests.commands import Agents, Run, Start, inside

PARTS = Path(__file__).parents[1] / "engine"
LAB = """\
[experiment]
name = "visited"
dt = "20 ms"
duration = "600 s"
pace = 1.0

[[input]]
name = "echo"
type = "visited.py:Echo"
cart = "robot/led/state"

[[robot]]
name = "led"
definition = "visited.py:Cart"
driver = "kinematic"
command = "process/pilot"

[[robot]]
name = "slow"
definition = "visited.py:Cart"
driver = "kinematic"
command = "input/echo"
every = 3

[[process]]
name = "pilot"
type = "visited.py:Pilot"
cart = "robot/slow/state"
"""


def carts(**more: Any) -> Experiment:
    """Two carts: one is led by a process, one by what an input sees of the first."""
    lab = Experiment("visited", dt=0.1, duration=3.0, seed=4, folder=PARTS)
    lab.input("echo", "visited.py:Echo", cart="robot/led/state")
    lab.process("pilot", "visited.py:Pilot", cart="robot/slow/state")
    for name, source, every in (("led", "process/pilot", 1), ("slow", "input/echo", 3)):
        lab.robot(
            name, "visited.py:Cart", "kinematic", command=source, every=every, **more
        )
    return lab


def visited(folder: Path) -> Path:
    """Record the carts in an engine, whose caller calls verbs."""
    with carts().engine(folder) as engine:
        engine["robot/led"].put(0.5)
        engine.step(10)
        engine["pilot"].shout(8.0)
        engine["led"].reset()
        engine.step(7)
        with pytest.raises(ValueError, match="there is no floor"):
            engine["led"].put(-1, load=2.0)
        engine["slow"].put(3.0, load=0.5)
        engine.run()
    return folder / "run.mcap"


def calls(path: Path) -> list[tuple[str, Outside]]:
    found = [(key, Outside.read(text)) for _, key, text in McapFile(path).events()]
    return [(key, one) for key, one in found if one is not None]


def test_what_a_caller_of_an_engine_calls_is_called_again(tmp_path: Path) -> None:
    path = visited(tmp_path / "run")
    assert calls(path) == [
        ("robot/led", Outside(0, "put", [0.5])),
        ("process/pilot", Outside(10, "shout", [8.0])),
        ("robot/led", Outside(10, "reset", [])),
        ("robot/led", Outside(17, "put", [-1], {"load": 2.0})),
        ("robot/slow", Outside(17, "put", [3.0], {"load": 0.5})),
    ]
    done = inside("rerun", str(tmp_path / "run"), folder=PARTS)
    assert SAME in done.stdout, done
    assert done.returncode == 0
    shared = rebuild(path, PARTS)
    in_one_host(shared.lab)
    assert compare(shared, fabric=True).differ == 0
    without = rebuild(path, PARTS)
    without.lab.plans["robot/slow"].again = ()
    other = compare(without)
    assert min(one.tick for one in other.found.values()) == 18
    assert other.by_agent()[0][0] == "robot/slow"


def test_an_agent_alone_has_its_own_calls_again(tmp_path: Path) -> None:
    visited(tmp_path / "run")
    for key in ("robot/led", "process/pilot", "input/echo"):
        done = inside("rerun", str(tmp_path / "run"), "--only", key, folder=PARTS)
        assert SAME in done.stdout, done


def test_a_run_without_calls_has_the_same_bytes(tmp_path: Path) -> None:
    """Also if its caller has looked at every agent."""
    found = set()
    for looks in (False, True):
        with carts().engine(tmp_path / str(looks)) as engine:
            for _ in range(30):
                engine.step()
                if looks:
                    assert engine["led"].state.x == engine["robot/led"].state.x
        data = (tmp_path / str(looks) / "run.mcap").read_bytes()
        found.add(hashlib.sha256(data).hexdigest())
    assert len(found) == 1
    assert BEGIN.encode() not in data


def test_arguments_that_no_recording_holds_are_named_first(tmp_path: Path) -> None:
    with carts().engine(tmp_path / "run") as engine:
        engine.step(4)
        engine["led"].take(object())
        engine["slow"].take({1: 2})
        engine.run()
    done = inside("rerun", str(tmp_path / "run"), folder=PARTS)
    first, second, *rest = done.stdout.splitlines()
    assert first == (
        "robot/led.take() was called from outside after tick 4, with arguments that no "
        "recording holds (Object of type object is not JSON serializable): it is not "
        "repeated, and what follows may differ."
    )
    assert second.startswith("robot/slow.take() was called from outside after tick 4")
    assert "robot/led      recomputed  differs from tick 5 (0.5 s) on" in rest
    assert done.returncode == 1


def test_a_verb_that_is_gone_is_named(tmp_path: Path) -> None:
    visited(tmp_path / "run")
    way = ("--replace", "process/pilot=visited.py:Mute")
    done = inside("rerun", str(tmp_path / "run"), *way, folder=PARTS)
    assert done.returncode == 1
    assert done.stdout.startswith(
        "process/pilot.shout() was called from outside after tick 10, and there is no "
        "such verb here: it is not repeated.\n"
    )


@pytest.mark.parametrize(
    "text",
    [
        *("joined", BEGIN, f"{BEGIN}x: {{}}", f"{BEGIN}3: [", f"{BEGIN}3: [1]"),
        *(f'{BEGIN}3: {{"verb": "a", "more": 1}}', f"{BEGIN}3: {{}}"),
    ],
)
def test_an_event_that_is_no_call(text: str) -> None:
    assert Outside.read(text) is None


def test_a_call_half_way_by_another_process(
    folder: Path, program: Run, rems: Run, start: Start, agents: Agents
) -> None:
    """Each agent and the recorder in a process of its own."""
    (folder / "visited.py").write_bytes((PARTS / "visited.py").read_bytes())
    (folder / "lab.toml").write_text(LAB)
    running = start("run", "lab.toml")
    agents(10)
    assert rems("call", "robot/led", "reset").returncode == 0
    done = program("call", "robot/slow", "put", "2.5", "load=0.125")
    assert json.loads(done.stdout) == 2.5
    with join() as fabric:
        fabric.robot("led").put(0.75, load=4.0)
        fabric.call("process/pilot", "shout", (3.0,), {})
    n = max(one["tick"] for one in agents())
    until(lambda: min(one["tick"] for one in agents()) > n + 10)
    assert rems("clock", "end").returncode == 0
    assert running.wait(20) == 0
    path = folder / "runs" / "visited" / "run.mcap"
    found = calls(path)
    assert sorted((key, *one[1:4]) for key, one in found) == [
        ("process/pilot", "shout", [3.0], {}),
        ("robot/led", "put", [0.75], {"load": 4.0}),
        ("robot/led", "reset", [], {}),
        ("robot/slow", "put", [2.5], {"load": 0.125}),
    ]
    assert all(10 <= one.n < n + 10 for _, one in found)
    for way in ((), ("--fabric",)):
        again = program("rerun", "runs/visited", *way)
        assert SAME in again.stdout, again
        assert again.returncode == 0


@pytest.mark.parametrize("fabric", [False, True])
def test_values_that_were_put_and_a_stop_are_repeated(
    tmp_path: Path, fabric: bool
) -> None:
    lab = Experiment("driven", dt=0.1, duration=3.0)
    lab.robot("a", "woodbot", "kinematic")
    lab.robot("b", "woodbot", "kinematic", every=3)
    with lab.engine(tmp_path) as engine:
        engine.step(3)
        engine.put("robot/a/command", {"wheel/left": "50 %", "wheel/right": 2.0})
        engine.step(2)
        engine.put("robot/b/command", {"wheel/left": 1.0, "wheel/right": 2.0})
        engine.step(3)
        engine.stop()
        engine.step(3)
        engine.release()
        engine.put("robot/a/command", {"wheel/left": 3.0, "wheel/right": 2.0})
        engine.step(19)
    path = tmp_path / "run.mcap"
    assert [*McapFile(path).holds()] == [(9, True), (12, False)]
    again = rebuild(path, tmp_path)
    in_one_host(again.lab)
    again.check()
    assert compare(again, fabric=fabric).differ == 0
    without = rebuild(path, tmp_path)
    without.lab.plans["robot/a"].again = ()
    without.check()
    assert min(one.tick for one in compare(without).found.values()) == 4

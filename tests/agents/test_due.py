"""Jobs with a step in which their result is due: given then, however long they take."""

import random
import re
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.background import jobs
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.runtime import runtime
from rems_net.errors import AgentError, uncoded
from rems_net.events import Event, listening
from tests.agents.runs import PARTS, Told, in_one_host
from tests.signals import freeze, thaw

both = pytest.mark.parametrize("process", [False, True], ids=["thread", "process"])


def lab(kind: str = "Learner", ticks: int = 40, **options: Any) -> Experiment:
    made = Experiment("due", dt=0.02, duration=ticks * 0.02, folder=PARTS)
    made.input("wheels", "parts.py:Wheels")
    made.robot("cart", "woodbot", "kinematic", command="input/wheels")
    made.process("learner", f"due.py:{kind}", pose="robot/cart/state", options=options)
    made.output("log", "csv", robots="process/*/*")
    return made


@both
def test_a_result_comes_in_exactly_the_step_in_which_it_is_due(process: bool) -> None:
    with lab(due=3, process=process).engine() as engine:
        engine.step(40)
        came = engine["process/learner"].came
    assert came == [(n, n - 3) for n in range(4, 41)]


def learned(folder: Path) -> bytes:
    return (folder / "process.learner.csv").read_bytes()


def frozen(folder: Path, freezes: int) -> None:
    """Run in an engine whose workers are frozen that many times, during ticks."""
    rng, done = random.Random(7), 0
    with lab(due=2, process=True, ticks=freezes + 5).engine(out=folder) as engine:
        agent = engine["process/learner"]
        for _ in range(freezes + 5):
            workers = runtime(agent).jobs._workers if done < freezes else None
            pids = [one._process.pid or 0 for one in workers._all] if workers else []
            for pid in pids:
                freeze(pid)
            thaw = threading.Timer(rng.uniform(0.0, 0.01), resume, [pids])
            thaw.start()
            engine.step()
            thaw.join()
            done += bool(pids)
    assert done == freezes


def resume(pids: list[int]) -> None:
    for pid in pids:
        thaw(pid)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot freeze a process")
@pytest.mark.parametrize("freezes", [20, pytest.param(1000, marks=pytest.mark.slow)])
def test_a_frozen_worker_changes_no_byte(tmp_path: Path, freezes: int) -> None:
    frozen(tmp_path / "frozen", freezes)
    made = lab(due=2, ticks=freezes + 5)
    made.run(tmp_path / "calm", direct=True, show=Show())
    assert learned(tmp_path / "frozen") == learned(tmp_path / "calm")


def test_an_engine_one_host_and_many_hosts_give_the_same_bytes(tmp_path: Path) -> None:
    found = {}
    for way in ("engine", "one", "many"):
        made = lab(process=way == "many", rest=0.002)
        if way == "one":
            in_one_host(made)
        made.run(tmp_path / way, direct=way == "engine", show=Told())
        found[way] = learned(tmp_path / way)
    assert found["engine"] == found["one"] == found["many"]
    assert found["engine"].count(b"\n") == 41


def test_a_late_job_holds_the_tick_and_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(jobs, "PATIENCE", 0.05)
    events: list[Event] = []
    with listening(events.append), lab(due=1, rest=0.3).engine() as engine:
        engine.step(2)
        assert engine["process/learner"].came == [(2, 1)]
    assert [(e.level, e.tick, e.agent, e.text) for e in events] == [
        (
            "warning",
            2,
            "process/learner",
            "tick 2 is held by process/learner for 0.05 s, waiting for job train, "
            "whose result is due at this step",
        )
    ]


def test_the_clock_names_a_job_that_holds_the_tick(tmp_path: Path) -> None:
    told = Told()
    in_one_host(lab(due=1, rest=1.6, ticks=2), HERE).run(tmp_path, show=told)
    assert any(
        re.search(
            r"tick 2 is held by process/learner.*waiting for job train, whose", line
        )
        for line in told.lines
    ), told.lines


def test_a_free_running_agent_never_waits(tmp_path: Path) -> None:
    """As the robot of a device: it gets a late result late, and the run reports it."""
    told = Told()
    made = in_one_host(lab("Free", due=1, rest=0.3, ticks=60), HERE)
    made.run(tmp_path, pace=1, show=told)
    late = r"process/learner: the result of job train came \d+ steps late; a free-.*"
    assert any(re.search(late, line) for line in told.lines), told.lines
    assert not any("is held by process/learner" in line for line in told.lines)


def test_an_exception_comes_in_that_step_too(tmp_path: Path) -> None:
    with pytest.raises(AgentError, match=r"ZeroDivisionError.*tick 7") as caught:
        lab("Failing", due=5).run(tmp_path, direct=True, show=Show())
    assert caught.value.agent == "process/learner"


@pytest.mark.parametrize(
    ("due", "sentence"),
    [
        (0, "a job is due=-1; expected the number of steps .*such as due=20."),
        (1, "a job with due=... is Learner.take, a method of an object, .*"),
    ],
)
def test_what_cannot_be_due_is_refused(tmp_path: Path, due: int, sentence: str) -> None:
    with pytest.raises(AgentError) as caught:
        lab("Wrong", due=due).run(tmp_path, direct=True, show=Show())
    assert re.match(f"process/learner: {sentence}", uncoded(caught.value))

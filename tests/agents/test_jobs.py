"""Jobs: beside the ticks, delivered in the agent's own thread, ended with it."""

import os
import re
from pathlib import Path

import pytest

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.errors import AgentError, uncoded
from tests.agents.runs import (
    PARTS,
    WAS_KILLED,
    Told,
    calm,
    relatives,
    shared_memory,
    until,
)
from tests.signals import KILL, KILLED

both = pytest.mark.parametrize("process", [False, True], ids=["thread", "process"])


def lab(what: str, process: bool, ticks: int = 100_000) -> Experiment:
    made = Experiment("jobs", dt=0.001, duration=ticks * 0.001, folder=PARTS, pace=1)
    made.input("noting", "noting.py:Noting", options={"what": what, "process": process})
    made.output("counts", "parts.py:Counts")
    made.plans["output/counts"].host = "input/noting"
    return made


def end_when(told: Told, condition: str) -> Told:
    """Ends the run when a line that it says matches."""

    def beside(clock: Clock) -> None:
        try:
            until(lambda: any(re.search(condition, line) for line in told.lines), 60)
        finally:
            clock.pacing.end()

    told._beside = beside
    return told


@both
def test_a_result_comes_to_a_later_step_in_the_agents_own_thread(
    tmp_path: Path, process: bool
) -> None:
    told = end_when(Told(), "job gave")
    lab("square", process).run(tmp_path, show=told)
    assert told.said == ["[input/noting] job gave 144, in the agent's thread: True"]
    rows = (tmp_path / "counts.txt").read_text(encoding="utf-8").splitlines()
    delivered = {int(row.split()[4]) for row in rows} - {0}
    assert all(n > 3 for n in delivered)


@both
def test_a_long_job_delays_no_tick(tmp_path: Path, process: bool) -> None:
    """A job of 2 s in a run at 1 kHz: the ticks go on, thousands of them."""
    told = end_when(Told(), "job gave rested")
    lab("long", process).run(tmp_path, show=told)
    rows = (tmp_path / "counts.txt").read_text(encoding="utf-8").splitlines()
    ticks = [int(row.split()[0]) for row in rows]
    assert ticks == list(range(1, len(ticks) + 1))
    # At 1 kHz they would be 2000; a busy machine makes fewer, a waiting one 3.
    assert len(ticks) > 50


@pytest.mark.parametrize(
    ("what", "process", "sentence"),
    [
        ("fails", False, "LookupError: 3 is not there"),
        ("fails", True, "LookupError: 3 is not there"),
        ("dies", True, f"RuntimeError: the process of job die {WAS_KILLED}"),
    ],
)
def test_an_exception_is_delivered(
    tmp_path: Path, what: str, process: bool, sentence: str
) -> None:
    told = end_when(Told(), "job failed")
    lab(what, process).run(tmp_path, show=told)
    assert told.said == [f"[input/noting] job failed: {sentence}"]


@both
@pytest.mark.parametrize(
    ("what", "sentence"),
    [
        (
            "raises",
            r"LookupError: 3 is not there \(noting.*, in fail, tick \d+\)",
        ),
        ("called", r"jobs\.submit takes a function .* write submit\(f, x\), not .*"),
    ],
)
def test_without_anybody_to_tell_it_is_raised(
    tmp_path: Path, process: bool, what: str, sentence: str
) -> None:
    with pytest.raises(AgentError) as caught:
        lab(what, process).run(tmp_path, pace="fast", direct=True)
    assert re.fullmatch("input/noting: " + sentence, uncoded(caught.value))


def test_what_another_process_cannot_find_is_told(tmp_path: Path) -> None:
    with pytest.raises(AgentError) as caught:
        lab("lambda", True).run(tmp_path, pace="fast", direct=True)
    assert uncoded(caught.value) == (
        "input/noting: Noting.read.<locals>.<lambda> is defined inside a function, "
        "where another process cannot find it; define it at the top of the file. "
        "(noting.py, line 45, in read, tick 3)"
    )


@both
@pytest.mark.parametrize("what", ["endless", "busy"])
def test_a_running_job_holds_up_no_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, process: bool, what: str
) -> None:
    monkeypatch.setenv("PARTS_MARK", str(tmp_path))
    told = Told()
    begun = []

    def beside(clock: Clock) -> None:
        until(lambda: clock.tick.n > 50)
        if process:  # the host, and at least one worker
            until(lambda: len(relatives(f"PARTS_MARK={tmp_path}")) > 1)
        assert shared_memory(f"PARTS_MARK={tmp_path}") == set()
        begun.append(calm())
        clock.pacing.end()

    told._beside = beside
    lab(what, process).run(tmp_path, show=told)
    assert calm() - begun[0] < 3
    until(lambda: not relatives(f"PARTS_MARK={tmp_path}"), 3)
    assert told.said == []


def test_a_killed_agent_takes_its_workers_along(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARTS_MARK", str(tmp_path))

    def beside(clock: Clock) -> None:
        until(lambda: len(relatives(f"PARTS_MARK={tmp_path}")) > 1)
        agent, *_ = until(
            lambda: [s for s in clock.status() if s["agent"] == "input/noting"]
        )
        os.kill(int(agent["host"].rpartition(":")[2]), KILL)

    with pytest.raises(AgentError, match=KILLED):
        lab("endless", True).run(tmp_path, show=Told(beside))
    until(lambda: not relatives(f"PARTS_MARK={tmp_path}"), 3)

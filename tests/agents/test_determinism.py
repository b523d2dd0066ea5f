"""The same experiment gives the same bytes: anywhere, however slow or disturbed."""

import functools
import os
import sys
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.protocol.terms import Wait
from rems_net.errors import RemsError
from tests.agents.runs import KEPT, PARTS, Router, Told, digest, in_one_host, until
from tests.signals import freeze, thaw

Change = Callable[[Experiment], object]


def lab(ticks: int = 60, **more: Any) -> Experiment:
    """Three robots, a loop between two of them, an input, two outputs."""
    made = Experiment("same", dt=0.05, duration=ticks * 0.05, folder=PARTS, **more)
    made.input("wave", "parts.py:SleepyWave")
    for name, command in (
        ("lead", "input/wave"),
        ("free", "input/wave"),
        ("dog", "process/follow"),
    ):
        made.robot(
            name,
            "parts.py:Cart",
            "parts.py:SleepyEuler",
            command=command,
            initial={"y": 0.5} if name == "dog" else {},
        )
    made.process(
        "follow",
        "parts.py:SleepyFollow",
        leader="robot/lead/state",
        me="robot/dog/state",
    )
    made.output("csv", "parts.py:SleepyCsv")
    made.output("log", "parts.py:SleepyLog")
    return made


def record(out: Path, change: Change | None = None, **more: Any) -> str:
    """Run it, and return the digest of everything it has written."""
    made = lab(**more)
    if change is not None:
        change(made)
    told = Told()
    try:
        made.run(out, show=told)
    except RemsError as error:
        raise AssertionError(f"{error}: {told.lines}") from error
    return digest(out)


@functools.cache
def expected(ticks: int = 60) -> str:
    """What every run must have written: what one host for all agents does."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        found = record(out, in_one_host, ticks=ticks)
        assert sorted(p.name for p in out.iterdir()) == [
            "dog.csv",
            "free.csv",
            "lead.csv",
            "log.txt",
            "run.json",
            "run.mcap",
        ]
        rows = (out / "dog.csv").read_text(encoding="utf-8").splitlines()
        assert len(rows) == ticks + 1
        assert len(set(rows)) == ticks + 1
    return found


def in_two_hosts(made: Experiment) -> None:
    for i, plan in enumerate(made.plans.values()):
        plan.host = f"h{i % 2}"


def in_a_few(made: Experiment) -> None:
    """One robot alone, the outputs together, all others together; the last first."""
    made.plans = dict(reversed(made.plans.items()))
    for key, plan in made.plans.items():
        plan.host = "output" if key.startswith("output/") else "rest"
    made.plans["robot/dog"].host = "dog"


def repeat(count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """However its agents are spread and started, and each slow at random."""
    reference = expected()
    monkeypatch.setenv("PARTS_SLEEP", "0.01")
    ways = [None, in_two_hosts, in_a_few]
    found = {record(tmp_path / str(i), ways[i % 3]) for i in range(count)}
    assert found == {reference}


def test_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first run has a process for each agent, the second has two processes."""
    repeat(2, tmp_path, monkeypatch)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_fifty_times(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    repeat(50, tmp_path, monkeypatch)


def test_one_core_only(tmp_path: Path) -> None:
    """All threads and processes that a run starts take turns."""
    if sys.platform != "linux":
        pytest.skip("only Linux ties a process to a core")
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        assert record(tmp_path / "a", in_a_few) == expected()
    finally:
        os.sched_setaffinity(0, cores)


@pytest.mark.parametrize(
    "seconds", [1.0, pytest.param(10.0, marks=pytest.mark.slow)], ids=["1 s", "10 s"]
)
def test_stalls_in_any_agent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seconds: float
) -> None:
    reference = expected()
    monkeypatch.setenv("PARTS_STALL", f"dog@20@{seconds} csv@40@{seconds}")
    assert record(tmp_path / "a", in_a_few) == reference


# -- joins and departures ------------------------------------------------------------


def late(made: Experiment) -> None:
    """The leader comes at tick 21, and one more robot at tick 31."""
    made.plans["robot/lead"].since = 21
    made.robot(
        "late", "parts.py:Cart", "parts.py:Euler", command="process/follow", since=1.5
    )


def test_joins_at_a_tick(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def late_in_one(made: Experiment) -> None:
        late(made)
        in_one_host(made)

    first = record(tmp_path / "0", late_in_one)
    rows = (tmp_path / "0" / "late.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 31
    assert float(rows[1].split(",")[0]) == 31 * 0.05

    def late_in_a_few(made: Experiment) -> None:
        late(made)
        in_a_few(made)
        made.plans["robot/late"].host = "late"

    monkeypatch.setenv("PARTS_SLEEP", "0.005")
    assert record(tmp_path / "1", late_in_a_few) == first


@pytest.mark.parametrize(("victim", "how"), [("dog", "kill_at"), ("lead", "raise_at")])
def test_a_departure_at_a_tick(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, victim: str, how: str
) -> None:
    def fail(made: Experiment) -> None:
        made.plans[f"robot/{victim}"].options = {how: 25}
        made.plans[f"robot/{victim}"].host = "own"

    def fail_beside_a_few(made: Experiment) -> None:
        in_a_few(made)
        fail(made)

    def fail_beside_one_host(made: Experiment) -> None:
        in_one_host(made)
        fail(made)

    first = record(tmp_path / "0", fail_beside_a_few, on_failure="drop")
    for name in ("dog", "free", "lead"):
        rows = (tmp_path / "0" / f"{name}.csv").read_text("utf-8").splitlines()
        assert len(rows) == 1 + (24 if name == victim else 60)
    monkeypatch.setenv("PARTS_SLEEP", "0.005")
    assert record(tmp_path / "1", fail_beside_one_host, on_failure="drop") == first


# -- what is lost --------------------------------------------------------------------


def _reach(clock: Clock, n: int) -> None:
    until(lambda: clock.tick.n >= n, 120)


def pid_of(clock: Clock, agent: str) -> int:
    (found,) = [s for s in clock.status() if s["agent"] == agent]
    return int(found["host"].rpartition(":")[2])


def test_a_host_that_is_frozen_for_longer_than_its_lease(tmp_path: Path) -> None:
    """Its link is cut, and what was sent meanwhile is lost; then it goes on."""

    def hold(clock: Clock) -> None:
        _reach(clock, 10)
        pid = pid_of(clock, "robot/dog")
        freeze(pid)
        threading.Event().wait(4.0)
        thaw(pid)

    told = Told(hold)
    made = lab()
    in_a_few(made)
    made.run(tmp_path / "a", pace=1, show=told)
    assert digest(tmp_path / "a") == expected()
    assert any("is held by robot/dog on " in line for line in told.of("held"))


@pytest.mark.timeout(400)
def test_a_router_that_is_killed_and_comes_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reference = expected(150)
    with Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)

        def restart(clock: Clock) -> None:
            for n in (30, 80):
                _reach(clock, n)
                router.kill()
                router.start()

        made = lab(150)
        made.wait = Wait(back=KEPT)
        in_a_few(made)
        made.run(tmp_path / "a", show=Told(restart))
        assert digest(tmp_path / "a") == reference

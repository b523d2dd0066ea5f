"""STOP of real runs: frozen, held, gone and new clocks, frozen robots, the next run."""

import json
import os
import platform
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from rems_net import join
from rems_net.agents.protocol.plan import HERE
from rems_net.client import Fabric
from rems_net.errors import FabricError
from tests.agents.runs import PARTS, Router, alive, until
from tests.commands import inside as rems
from tests.interrupts import APART, interrupt
from tests.signals import KILL, freeze, thaw

SCRIPT = f"""
from rems_net import Experiment
lab = Experiment("told", dt=0.02, duration="60 s", pace=1, folder={str(PARTS)!r})
lab.record = False
for name in ("a", "b"):
    lab.robot(name, "parts.py:Cart", "parts.py:Euler", host=HOST)
lab.run("out")
"""

Run = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def router(monkeypatch: pytest.MonkeyPatch) -> Iterator[Router]:
    """A router of its own process, which REMS_ROUTER names."""
    with Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        yield router


@pytest.fixture
def run(tmp_path: Path, router: Router) -> Iterator[Run]:
    """Starts a run in a process of its own; everything is killed at the end.

    host: that of both robots; without it, each has a process.
    """
    script = tmp_path / "told.py"
    started: list[subprocess.Popen[str]] = []
    hosts: set[int] = set()

    def start(host: str = "") -> subprocess.Popen[str]:
        script.write_text(SCRIPT.replace("HOST", repr(host)), encoding="utf-8")
        process = subprocess.Popen(
            [sys.executable, str(script)],
            cwd=tmp_path,
            stderr=subprocess.PIPE,
            text=True,
            **APART,
        )
        started.append(process)
        with join() as fabric:
            hosts.update(until(lambda: pids(fabric)).values())
        return process

    yield start
    for process in started:
        process.kill()
        process.wait()
        if process.stderr is not None:
            process.stderr.close()
    for pid in hosts:
        with suppress(ProcessLookupError):
            os.kill(pid, KILL)


def pids(fabric: Fabric) -> dict[str, int]:
    """The process of each agent, once both have done some ticks."""
    with suppress(FabricError):
        here = fabric.agents()
        if len(here) == 2 and all(a["tick"] > 2 for a in here):
            return {a["agent"]: int(a["host"].rpartition(":")[2]) for a in here}
    return {}


def drive(fabric: Fabric, name: str) -> None:
    fabric.robot(name).command.speed = 1.0


def state(fabric: Fabric, name: str) -> tuple[int, float]:
    """The newest tick of a robot, and where it is."""
    told = until(lambda: fabric.get(f"robot/{name}/state"))[f"rems/robot/{name}/state"]
    return told["tick"], told["values"]["x"]["value"]


def moves(fabric: Fabric, name: str) -> bool:
    """Whether it goes on, once it is commanded."""
    _, before = state(fabric, name)

    def further() -> bool:
        drive(fabric, name)
        return state(fabric, name)[1] > before + 0.01

    return bool(until(further))


def stands(fabric: Fabric, name: str) -> bool:
    """Whether it stays where it is for 25 ticks, although it is commanded.

    Robots that are simulated obey STOP at a tick, which the clock has yet to make.
    """

    begun, where = state(fabric, name)

    def still() -> bool:
        nonlocal begun, where
        drive(fabric, name)
        n, x = state(fabric, name)
        if x != where:
            begun, where = n, x
        return n >= begun + 25

    return bool(until(still))


def test_a_moving_robot_stands_and_goes_on_when_released(run: Run) -> None:
    run()
    with join() as fabric:
        assert moves(fabric, "a")
        receipts = fabric.stop()
        assert [r.robot for r in receipts] == ["robot/a", "robot/b"]
        assert all(r.stands and r.tick > 0 for r in receipts)
        assert stands(fabric, "a")
        assert fabric.release() == ["robot/a", "robot/b"]
        assert moves(fabric, "a")
        assert fabric.release() == []
        # ...and while the clock is paused.
        fabric.clock("pause")
        until(lambda: all(r.stands for r in fabric.stop()))
        drive(fabric, "b")
        fabric.clock("resume")
        assert stands(fabric, "b")


def test_while_the_clock_is_frozen(run: Run) -> None:
    """The clock is frozen: robots say that they stand, and stay so when it thaws."""
    process = run("both")
    with join() as fabric:
        assert moves(fabric, "a")
        freeze(process.pid)
        until(lambda: all(r.stands for r in fabric.stop()))
        thaw(process.pid)
        assert stands(fabric, "a")


def test_a_robot_that_was_frozen_meanwhile(run: Run) -> None:
    """Its host was stopped when STOP was put: it is named, and obeys when it thaws."""
    run()
    with join() as fabric:
        assert moves(fabric, "a")
        frozen = pids(fabric)["robot/a"]
        freeze(frozen)
        try:
            a, b = fabric.stop()
            done = rems("stop")
        finally:
            thaw(frozen)
        assert (a.robot, a.stands, b.robot, b.stands) == (
            "robot/a",
            False,
            "robot/b",
            True,
        )
        assert done.returncode == 1
        # The router loses it after 3 s.
        who = rf"robot/a on {platform.node()}(, last seen \d+ s ago,)? has not answered"
        assert re.search(who, done.stdout)
        assert "robot/b stands at tick " in done.stdout
        until(lambda: fabric.agents()[0]["seen"] < 0.5)
        assert stands(fabric, "a")


def test_a_frozen_robot_that_is_out_of_sight_is_named(run: Run) -> None:
    """Its token went away with its link; the roster still has it."""
    run()
    with join() as fabric:
        frozen = pids(fabric)["robot/a"]
        freeze(frozen)
        try:
            key = fabric.session.key("robot", "a", "@alive")
            until(lambda: not fabric.session.who(key))
            a, b = fabric.stop()
            assert rems("stop").returncode == 1
        finally:
            thaw(frozen)
    assert re.fullmatch(
        rf"robot/a on {platform.node()}(, last seen \d+ s ago,)? has not answered: "
        "it may drive on until it is back",
        str(a),
    )
    assert (b.robot, b.stands) == ("robot/b", True)


def test_it_outlives_the_run_and_the_router_keeps_it(run: Run, router: Router) -> None:
    """The next run on that router starts stopped, says so, and can be released."""
    first = run(HERE)
    with join() as fabric:
        fabric.stop()
        hosts = pids(fabric)
    interrupt(first)
    first.communicate(timeout=20)
    until(lambda: not any(alive(pid) for pid in hosts.values()))
    second = run(HERE)
    with join() as fabric:
        assert json.loads(fabric.session.ask("rems/clock/tick?format=json")[0].payload)[
            "stops"
        ]
        assert stands(fabric, "a")
        assert fabric.release() == ["robot/a", "robot/b"]
        assert moves(fabric, "a")
    interrupt(second)
    _, said = second.communicate(timeout=20)
    assert re.search(
        r"\[clock\] STOP on 'rems' at [\d:]{8}, by 127\.0\.0\.1: robots must stand "
        r"until `rems stop --release`\n",
        said,
    )
    run(HERE)
    with join() as fabric:
        assert moves(fabric, "a")


def test_a_router_lets_go_without_a_clock(run: Run, router: Router) -> None:
    first = run(HERE)
    with join() as fabric:
        fabric.stop()
    first.kill()
    first.communicate()
    with join() as fabric:
        until(lambda: not fabric.session.who("rems/clock/@alive"))
        assert fabric.release() is True
        assert fabric.release() is False

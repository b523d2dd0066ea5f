"""A member that crashed is started again, as often as the experiment says."""

import os
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.protocol.plan import HERE
from rems_net.errors import AgentError, ExperimentError, uncoded
from tests.agents.bringing import bring
from tests.agents.runs import PARTS, Router, Told, digest, until
from tests.signals import KILL, KILLED, freeze

CRASHING = "tests.agents.experiment.crashing"
#: how it crashes, and what is told of it
WAYS = {
    "kill": KILLED,
    "exit": r"exited with status 7",
    "raise": r"ZeroDivisionError: no more \(crashing\.py, line \d+, in step, tick 5\)",
}


def lab(stick: str = "", wheel: str = "", log: str = "", **more: Any) -> Experiment:
    """Return an experiment in which each agent crashes in this way, or "" for never.

    An agent that crashes has a process; the others live here.
    """
    given = {"times": more.pop("times", 1)}
    restart = more.pop("restart", 2)
    usual: dict[str, Any] = {"dt": 0.1, "duration": 2, "folder": PARTS, "record": False}
    made = Experiment("again", **usual | more)

    def way(how: str) -> dict[str, Any]:
        if not how:
            return {"options": {"times": 0}, "host": HERE}
        return {"options": {"how": how} | given, "restart": restart}

    made.input("stick", f"{CRASHING}:Stick", **way(stick))
    made.robot(
        "cart",
        "parts.py:Cart",
        f"{CRASHING}:Wheel",
        command="input/stick",
        **way(wheel),
    )
    made.output("csv", f"{CRASHING}:Writes", **way(log))
    return made


def rows(path: Path) -> list[list[float]]:
    text = path.read_text(encoding="utf-8")
    assert text.endswith("\n")
    _, *lines = text.splitlines()
    return [[float(cell) for cell in line.split(",")] for line in lines]


@pytest.mark.parametrize("how", WAYS)
def test_an_input_is_started_again(tmp_path: Path, how: str) -> None:
    told = Told()
    record = how == "kill"
    made = lab(stick=how, record=record).run(tmp_path / "out", show=told)
    assert made.ticks == 20
    (line,) = told.of("crashed")
    sentence = rf"input/stick crashed at tick 5 \({WAYS[how]}\); "
    assert re.fullmatch(sentence + "started again, 1 of 2", line), line
    (back,) = told.of("back")
    assert re.fullmatch(r"input/stick is back from tick 6 on, after \d+\.\d s", back)
    # The command stayed at tick 5, and is what the new one says from tick 6 on.
    turns = [row[2] for row in rows(tmp_path / "out/cart.csv")]
    assert turns == [0.0] * 5 + [0.1] * 15
    if record:
        lab(stick=how, record=True).run(tmp_path / "again", show=Told())
        ours, again = (digest(tmp_path / name) for name in ("out", "again"))
        assert ours == again


def test_a_robot_begins_anew_and_its_tick_is_missing(tmp_path: Path) -> None:
    lab(wheel="kill").run(tmp_path, show=Told())
    seen = rows(tmp_path / "cart.csv")
    times = [round(10 * row[0]) for row in seen]
    assert times == [1, 2, 3, 4, *range(6, 21)]
    assert [row[3] for row in seen[3:6]] == pytest.approx([0.2, 0.05, 0.1])


@pytest.mark.parametrize("how", ["kill", "raise"])
def test_an_output_goes_on_in_its_file(tmp_path: Path, how: str) -> None:
    made = lab(log=how, record=True).run(tmp_path / "out", show=Told())
    assert made.files == [tmp_path / "out/cart.csv", tmp_path / "out/run.mcap"]
    whole = lab().run(tmp_path / "whole", direct=True)
    seen, all_of_it = rows(made.files[0]), rows(whole.files[0])
    assert seen == all_of_it[:4] + all_of_it[5:]


@pytest.mark.parametrize("on_failure", ["stop", "drop"])
def test_only_so_often(tmp_path: Path, on_failure: str) -> None:
    told = Told()
    made = lab(stick="raise", times=9, on_failure=on_failure)
    last = r"input/stick: ZeroDivisionError: no more \(crashing\.py, .*, tick \d+\)"
    if on_failure == "stop":
        with pytest.raises(AgentError) as caught:
            made.run(tmp_path, show=told)
        assert re.fullmatch(last, uncoded(caught.value))
        assert len(rows(tmp_path / "cart.csv")) == 14
    else:
        made.run(tmp_path, show=told)
        (dropped,) = told.of("dropped")
        assert re.fullmatch(rf"{last}; dropped at tick 15", dropped)
        assert len(rows(tmp_path / "cart.csv")) == 20
    assert [line[-6:] for line in told.of("crashed")] == ["1 of 2", "2 of 2"]


def test_one_that_cannot_start_again(tmp_path: Path) -> None:
    told = Told()
    made = lab(stick="open", times=9)
    with pytest.raises(AgentError, match="the stick is not plugged in"):
        made.run(tmp_path, show=told)
    assert [line.partition(" (")[0] for line in told.of("crashed")] == [
        "input/stick crashed at tick 5",
        "input/stick crashed as it started",
    ]
    assert len(rows(tmp_path / "cart.csv")) == 5


def test_nobody_waits_for_a_free_one(tmp_path: Path) -> None:
    def end(clock: Clock) -> None:
        try:
            until(lambda: told.of("back") and clock.members.all["robot/cart"].n)
        finally:
            clock.pacing.end()

    made = Experiment("free", dt=0.02, duration=60, pace=1, folder=PARTS)
    made.record = False
    made.input("wave", "parts.py:Wave", host=HERE)
    options = {"how": "kill", "at": 20, "times": 1}
    free = f"{CRASHING}:Free"
    made.robot("cart", "parts.py:Cart", free, options=options, restart=1)
    other = ("parts.py:Cart", "parts.py:Euler")
    made.robot("other", *other, command="input/wave", host=HERE)
    made.output("csv", "csv", host=HERE)
    told = Told(end)
    ticks = made.run(tmp_path, show=told).ticks
    assert told.of("crashed")
    (back,) = told.of("back")
    assert back.startswith("robot/cart is back from tick")
    assert len(rows(tmp_path / "other.csv")) == ticks
    assert 20 <= len(rows(tmp_path / "cart.csv")) < ticks


def away(tmp_path: Path, back: float, beside: Any) -> tuple[Told, str, str]:
    """A run with its robot brought by another program: what both said, and how."""
    students: list[subprocess.Popen[str]] = []

    def start(clock: Clock) -> None:
        student = bring(PARTS, router=told.endpoint)
        students.append(student)
        until(lambda: clock.tick.n > 10, 60)
        beside(clock, student, clock.members.all["robot/cart"].pid)

    told, ended = Told(start), ""
    with Router() as router:
        os.environ["REMS_ROUTER"] = router.endpoint
        try:
            made = lab(pace=5.0, duration=60, wait={"back": back})
            cart = made.plans["robot/cart"]
            cart.machine, cart.host, cart.restart = "b", "robot/cart", 2
            made.run(tmp_path / "here", show=told)
        except AgentError as error:
            ended = str(error)
        finally:
            del os.environ["REMS_ROUTER"]
            for student in students:
                if ended:
                    student.kill()
                _, said = student.communicate(timeout=60)
    return told, said, ended


def test_one_of_another_machine_is_started_there(tmp_path: Path) -> None:
    def kill(clock: Clock, student: Any, pid: int) -> None:
        os.kill(pid, KILL)
        until(lambda: clock.members.all["robot/cart"].pid != pid, 60)
        n = clock.tick.n
        until(lambda: clock.tick.n > n + 10, 60)
        clock.pacing.end()

    told, said, ended = away(tmp_path, 20.0, kill)
    assert ended == ""
    assert (
        f"[robot/cart] robot/cart crashed ({KILLED}); started again, 1 of 2\n" in said
    )
    (line,) = told.of("crashed")
    assert re.fullmatch(
        r"robot/cart crashed at tick \d+ \(its process was lost\); "
        "started again, 1 of 2",
        line,
    )


def test_one_that_does_not_come_back_ends_the_run(tmp_path: Path) -> None:
    def leave(clock: Clock, student: Any, pid: int) -> None:
        freeze(pid)  # or it sees the other go, and says that it leaves
        os.kill(student.pid, KILL)
        os.kill(pid, KILL)

    _, _, ended = away(tmp_path, 1.0, leave)
    assert re.fullmatch(r"robot/cart: is out of sight on \S+ for 1 s \(R0522\)", ended)


@pytest.mark.parametrize("restart", [-1, True, "often", 1.5])
def test_what_is_no_number(restart: object) -> None:
    made = Experiment("again", folder=PARTS)
    with pytest.raises(ExperimentError) as caught:
        made.input("wave", "parts.py:Wave", restart=restart)
    assert uncoded(caught.value) == (
        f"input 'wave': restart is {restart!r}; expected how often it is started again "
        "after a crash, such as 3."
    )

"""Whole experiments: real processes, a real router, real failures."""

import gc
import math
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.plan import HERE
from rems_net.errors import AgentError, ExperimentError, uncoded
from tests.agents.runs import PARTS, Told, until


def carts(robots: int = 2, **options: object) -> Experiment:
    """An input, carts (the last, with `options`, in its own process) and a log."""
    lab = Experiment("carts", dt=0.1, duration="3 s", folder=PARTS)
    lab.input("wave", "parts.py:Wave", host=HERE)
    for i in range(robots):
        last = i == robots - 1
        lab.robot(
            f"r{i}",
            "parts.py:Cart",
            "parts.py:Euler",
            command="input/wave",
            options=options if last else {},
            host=None if last else HERE,
        )
    lab.output("log", "parts.py:Log", host=HERE)
    return lab


def rows(path: Path) -> list[list[str]]:
    return [line.split() for line in path.read_text(encoding="utf-8").splitlines()]


def test_all_values_of_a_tick_belong_together(tmp_path: Path) -> None:
    result = carts().run(tmp_path, direct=True)
    assert result.ticks == 30
    assert result.files == [tmp_path / "log.txt", tmp_path / "run.mcap"]
    seen = rows(tmp_path / "log.txt")
    assert [r[0] for r in seen] == [str(n) for n in range(1, 31) for _ in range(4)]
    # 50 % of 1 m/s; what is commanded at tick n acts over tick n
    turn = 2 * math.sin(0.1)
    for i in range(2):
        command, state = seen[2 * i], seen[2 * i + 1]
        assert command[:2] == ["1", f"robot/r{i}/command"]
        assert [float(v) for v in command[2:]] == pytest.approx([0.5, turn])
        assert [float(v) for v in state[2:]] == pytest.approx([0.05, 0.0, 0.1 * turn])


def test_what_the_clock_counts_as_done_an_output_has_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seen before: with its input a whole host was done, and a last row was lost."""
    monkeypatch.setenv("PARTS_STALL", "log@3@0.5 log@12@0.5")
    ahead = []

    def look(clock: Clock) -> None:
        log = tmp_path / "log.txt"
        until(lambda: clock.done)
        while clock.done < 12:
            done = clock.done
            if len(rows(log)) < done:
                ahead.append((done, len(rows(log))))

    lab = Experiment("carts", dt=0.1, duration="1.2 s", folder=PARTS)
    lab.input("wave", "parts.py:Wave", host=HERE)
    lab.output("log", "parts.py:SleepyLog", host=HERE, robots="input/*/*")
    told = Told(look)
    lab.run(tmp_path, show=told)
    assert not ahead
    assert not told.errors
    assert len(rows(tmp_path / "log.txt")) == 12


def test_what_the_program_has_frozen_stays_frozen(tmp_path: Path) -> None:
    gc.freeze()
    lab = Experiment("one", dt=0.1, duration="0.2 s", folder=PARTS, record=False)
    lab.input("wave", "parts.py:Wave")
    assert lab.run(tmp_path).ticks == 2
    assert gc.get_freeze_count() > 0


def test_an_empty_experiment_says_what_to_add() -> None:
    with pytest.raises(ExperimentError, match="this experiment has no agents; add"):
        Experiment("empty", duration=1).run()


@pytest.mark.parametrize(("pace", "least"), [("fast", 19 - AHEAD), (10, 19)])
def test_a_killed_agent_ends_the_run_and_is_named(
    tmp_path: Path, pace: float | str, least: int
) -> None:
    """Fast, it takes the last values with it that it had not sent yet."""
    lab = carts(kill_at=20)
    lab.record = False
    with pytest.raises(AgentError) as caught:
        lab.run(tmp_path, pace=pace)
    how = "exited with status" if os.name == "nt" else "was killed by signal"
    assert uncoded(caught.value) == f"robot/r1: {how} 15"
    ticks = [int(r[0]) for r in rows(tmp_path / "log.txt")]
    assert ticks == [n for n in range(1, ticks[-1] + 1) for _ in range(4)]
    assert least <= ticks[-1] <= 19


def test_a_glob_that_matches_nothing_is_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    lab = Experiment("glob", dt=0.1, duration="1 s", folder=PARTS)
    lab.input("wave", "parts.py:Wave")
    lab.output("log", "parts.py:Log", robots="robot/*/stat")
    lab.run(tmp_path, direct=True)
    told = capfd.readouterr().err
    assert told.count("output/log/robots reads 'robot/*/stat', which matches") == 1


def test_a_value_that_does_not_fit_is_dropped_and_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    lab = Experiment("fast", dt=0.1, duration="3 s", folder=PARTS, record=False)
    lab.input("fast", "parts.py:TooFast", host=HERE)
    lab.robot("cart", "parts.py:Cart", "parts.py:Euler", command="input/fast")
    lab.output("log", "parts.py:Log")
    lab.plans["output/log"].host = "robot/cart"
    lab.run(tmp_path)
    told = capfd.readouterr().err
    assert (
        "robot/cart/command dropped a value from input/fast/value "
        "(1 so far, now at 0.5 s): " in told
    )
    assert "speed" in told
    # And once more at the end, with the count of each kind of reason.
    last = next(line for line in told.splitlines() if "in all" in line)
    assert last.startswith(
        "[robot/cart] warning: robot/cart/command dropped 26 values in all. 26 x: "
        "robot/cart/command"
    )
    assert told.count("dropped a value from") == 1
    speed = [
        float(r[2]) for r in rows(tmp_path / "log.txt") if r[1].endswith("command")
    ]
    # The last valid command is of tick 4; it is obeyed for max_age = 0.5 s, no longer.
    assert speed == [0.5] * 9 + [0.0] * 21


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            lambda lab: lab.robot("a b", "parts.py:Cart", "parts.py:Euler"),
            "robot 'a b': the name of this robot is 'a b'; a name has 1 to 63 letters, "
            "digits, '_', '-' or '.', begins with a letter or a digit, and ends with "
            "no '.'.",
        ),
        (
            lambda lab: lab.process("p", "parts.py:Follow", leader="robot/r0/state"),
            "process 'p': its In 'me' is connected to nothing; write what it "
            "reads, such as me='robot/sim/state'.",
        ),
    ],
)
def test_bad_experiments_start_nothing(
    change: Callable[[Experiment], None], sentence: str
) -> None:
    lab = carts()

    def change_and_check() -> None:
        change(lab)
        lab.check()

    with pytest.raises(ExperimentError) as caught:
        change_and_check()
    assert uncoded(caught.value) == sentence

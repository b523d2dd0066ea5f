"""Sweeps: the same rows however they are computed, and no run is lost or made twice."""

from __future__ import annotations

import csv
import os
import re
import subprocess
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment, read, sweep
from rems_net.errors import ExperimentError, UnknownFieldError
from rems_net.sweeps.pool import Pool
from rems_net.sweeps.store import CSV
from tests.agents.runs import alive, until
from tests.commands import command, environment, inside, python
from tests.interrupts import APART, interrupt
from tests.sweeps.labs import content, lab, written

SETTINGS = {"input/weave.speed": "0.1..0.3 m/s/3", "input/weave.wild": [0.5, 1.0]}

#: what a process computes with: a test's own is not pinned
NUMERICS = re.compile(r'"numerics": "[^"]*"')


class Last(Executor):
    """Executor that makes what it is given last first, in this process."""

    def __init__(self, most: int = 1000) -> None:
        self.most, self.left = most, list[Callable[[], None]]()
        self.made = 0

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Take a call; the fourth one begins with all four."""
        future: Future[Any] = Future()
        self.left.append(lambda: self._make(future, fn, args))
        if len(self.left) == 4:
            while self.left:
                self.left.pop()()
        return future

    def _make(self, future: Future[Any], fn: Any, args: Any) -> None:
        if self.made == self.most:
            raise KeyboardInterrupt
        self.made += 1
        future.set_result(fn(*args))


def test_rows_and_files_are_the_same_in_any_order_by_any_workers(
    tmp_path: Path,
) -> None:
    made = lab(tmp_path / "lab")
    one = sweep(made, SETTINGS, seeds=2, out=tmp_path / "one", workers=1)
    two = sweep(made, SETTINGS, seeds=2, out=tmp_path / "two", workers=2)
    last = sweep(made, SETTINGS, seeds=2, out=tmp_path / "last", executor=Last())
    assert len(one) == 12
    assert one.csv() == two.csv() == last.csv() == (one.folder / CSV).read_bytes()
    assert content(one) == content(two)
    assert content(one).keys() == content(last).keys()
    sims = {data for name, data in content(one).items() if name.endswith("sim.csv")}
    assert len(sims) == 12  # each drives in another way


def test_a_run_of_a_sweep_is_that_run(tmp_path: Path) -> None:
    """Its files are those of `rems run --direct` with these values and this seed."""
    made = lab(tmp_path / "lab")
    swept = sweep(
        made, {"input/weave.speed": ["0.3 m/s"]}, seeds=[7], out=tmp_path / "s"
    )
    made.plans["input/weave"].options = {"speed": "0.3 m/s"}
    made.seed = 7
    alone = made.run(tmp_path / "alone", direct=True)
    for name in ("sim.csv", "run.mcap", "run.json"):
        there = (swept.folder / "001" / name).read_text(errors="replace")
        here = (alone.folder / name).read_text(errors="replace")
        assert NUMERICS.sub("", there) == NUMERICS.sub("", here), name
    x = alone["sim"]["state/x"][-1]
    assert (
        swept.table["sim.state.x [m]"][0]
        == float(x)
        == float(swept[1]["sim"]["state/x"][-1])
    )


def test_the_table_has_units(tmp_path: Path) -> None:
    swept = sweep(
        lab(tmp_path / "lab"),
        {"input/weave.speed": "0.1..0.3 m/s/2", "input/weave": "swept.py:Calm"},
        measure=["way = max(sim.state.x) - 1 m", "x > 10 cm", "mean(hypot(x, y))"],
        workers=1,
        out=tmp_path / "s",
    )
    with (swept.folder / CSV).open(encoding="utf-8", newline="") as file:
        first, second = csv.DictReader(file)
    assert [*first] == [
        *("run", "input/weave.speed [m/s]", "input/weave", "seed", "status", "ticks"),
        *("way [m]", "x > 10 cm", "mean(hypot(x, y)) [m]", "error"),
    ]
    assert first["input/weave"] == "swept.py:Calm"
    x = swept[2]["sim"]["state/x"]
    assert float(second["way [m]"]) == float(x.max()) - 1
    assert second["x > 10 cm"] == str(float(x[-1]) > 0.1)
    assert (first["status"], first["ticks"], first["error"]) == ("done", "20", "")
    assert swept.table["way [m]"].shape == (2,)
    with pytest.raises(UnknownFieldError, match="there is no run 3 in"):
        swept[3]
    with pytest.raises(ExperimentError, match=r"s is a sweep; name one .*s[/\\]001\."):
        read(swept.folder)


def test_the_table_for_other_programs(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas", reason="pandas is not installed (an extra)")
    pytest.importorskip("pyarrow", reason="pyarrow is not installed (an extra)")
    path = written(tmp_path)
    given = ("--set", "process/trouble.at=-1,5", "--parquet", "--workers", "1")
    done = inside("sweep", str(path), *given, "--out", "s", folder=tmp_path)
    assert done.returncode == 1, done
    assert done.stdout == f"2 runs, in {Path('s', CSV)} and {Path('s/table.parquet')}\n"
    frame = pandas.read_parquet(tmp_path / "s" / "table.parquet")
    assert frame["sim.state.x [m]"].isna().tolist() == [False, True]
    assert frame["process/trouble.at"].tolist() == [-1, 5]


def test_a_run_that_fails_stops_nobody_and_is_listed(tmp_path: Path) -> None:
    made = lab(tmp_path / "lab")
    values = {"process/trouble.at": [-1, 7, -1, 9]}
    swept = sweep(made, values, out=tmp_path / "s", workers=2)
    sentence = "process/trouble: ValueError: too much of it (swept.py, line"
    assert [*swept.failed] == [2, 4]
    assert all(text.startswith(sentence) for text in swept.failed.values())
    assert swept.table["ticks"].tolist() == [20, 6, 20, 8]
    assert len(swept[2]["sim"]["state/x"]) == 6  # what was recorded is there


@pytest.mark.parametrize("deaths", [1, 3])
def test_a_worker_that_dies(tmp_path: Path, deaths: int) -> None:
    """Its run is made again; a run whose workers always die is listed."""
    made = lab(tmp_path / "lab")
    file = tmp_path / "deaths"
    file.write_text(f"{deaths}")
    values = {"process/trouble.deadly": ["", str(file), ""]}
    swept = sweep(made, values, out=tmp_path / "s", workers=1)
    assert not file.exists()
    assert len(swept) == 3
    assert [*swept.failed] == [2][: deaths // 3]
    for text in swept.failed.values():
        how = "exited" if os.name == "nt" else "was killed by signal 15"
        assert text.startswith(
            f"its worker died 3 times: the process of job work {how}"
        )


def test_a_sweep_that_is_complete_makes_no_run(tmp_path: Path) -> None:
    made = lab(tmp_path / "lab")
    whole = sweep(made, seeds=4, out=tmp_path / "s", executor=Last())
    again = sweep(made, seeds=4, out=tmp_path / "s", executor=Last(0))
    assert whole.csv() == again.csv()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The rows of a sweep of eight runs that nobody interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    path = written(folder / "lab", "20 s")
    return sweep(path, seeds=8, out=folder / "s", workers=1).csv()


@pytest.mark.parametrize("how", [interrupt, subprocess.Popen.kill], ids=["int", "kill"])
def test_it_goes_on_after_a_signal(
    tmp_path: Path, whole: bytes, how: Callable[[subprocess.Popen[str]], None]
) -> None:
    path = written(tmp_path / "lab", "20 s")
    words = ["sweep", str(path), "--seeds", "8", "--workers", "2", "--out", "s"]
    running = subprocess.Popen(
        command(*words),
        cwd=tmp_path,
        env=environment(),
        stderr=subprocess.PIPE,
        encoding="utf-8",
        **APART,
    )
    try:
        until(lambda: len([*(tmp_path / "s").glob("0*")]) >= 1)
    finally:
        how(running)
        _, said = running.communicate()
    there = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "s").glob("0*")}
    assert 1 <= len(there) < 8
    if how is interrupt:
        assert running.returncode == 130
        assert f"{len(there)} of 8 runs are there; type the same command" in said
    done = inside(*words, folder=tmp_path)
    assert (done.returncode, done.stdout) == (0, f"8 runs, in {Path('s', CSV)}\n")
    now = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "s").glob("0*")}
    assert now.items() >= there.items()
    assert len(now) == 8
    assert not [*(tmp_path / "s").glob(".part*")]
    assert (tmp_path / "s" / CSV).read_bytes() == whole


def test_another_sweep_is_moved_away(tmp_path: Path) -> None:
    made = lab(tmp_path / "lab")
    sweep(made, seeds=1, out=tmp_path / "s", workers=1)
    sweep(made, seeds=2, out=tmp_path / "s", workers=1)
    assert len([*(tmp_path / "s.1").glob("0*")]) == 1
    assert len([*(tmp_path / "s").glob("0*")]) == 2


def test_a_pool_leaves_no_process() -> None:
    with Pool(2) as pool:
        pids = {pool.submit(os.getpid).result() for _ in range(4)}
    assert os.getpid() not in pids
    for pid in pids:
        until(lambda pid=pid: not alive(pid))  # type: ignore[misc]


SCRIPT = """
from rems_net import Experiment, Input, Out, Woodbot, sweep


class Ahead(Input):
    value = Out(Woodbot.command)

    def read(self, tick):
        return {"wheel": {"left": 2.0, "right": 3.0}}


print("once")
lab = Experiment("script", duration="1 s")
lab.input("ahead", Ahead)
lab.robot("sim", "woodbot", "kinematic", command="input/ahead")
print(len(sweep(lab, seeds=4, workers=2)))
"""


def test_a_script_needs_no_main_guard(tmp_path: Path) -> None:
    """Two workers that start at a time both leave its sweep alone."""
    (tmp_path / "script.py").write_text(SCRIPT)
    done = python(tmp_path, "script.py")
    assert (done.stdout, done.stderr, done.returncode) == ("once\n4\n", "", 0)


def test_robots_that_nothing_commands_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    still = Experiment("still", dt="0.1 s", duration="0.2 s")
    still.robot("sim", "woodbot", "kinematic")
    sweep(still, {"robot/sim.track": "90..130 mm/2"}, workers=1, out=tmp_path / "s")
    assert "warning: nothing commands robot/sim, and" in capsys.readouterr().err

"""Export: the bytes of an output of type csv, frames, Parquet; files of any size."""

from __future__ import annotations

import importlib
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rems_net
from rems_net import Experiment, Schema
from rems_net.agents.experiment.show import Show
from rems_net.cli import main
from rems_net.defdict import angle, cdr, length
from rems_net.errors import ExperimentError, MissingPartError, UnknownFieldError
from rems_net.recordings.mcap.writer import McapWriter
from tests.agents.test_determinism import in_a_few, lab as carts
from tests.commands import ROOT

STATE = Schema("state", {"x": length(), "heading": angle()})


@pytest.fixture
def both(tmp_path: Path) -> Path:
    """The folder of a run with outputs of both types, of robots of many kinds."""
    lab = Experiment("both", dt="50 ms", duration="1 s", seed=3)
    lab.robot("w", "woodbot", "kinematic")
    late: dict[str, Any] = {"since": 0.25, "every": 2, "initial": {"x": 0.2}}
    lab.robot("e", "epuck", "kinematic", options={"noise": True}, **late)
    lab.robot("y", "youbot", "kinematic", since=0.7)
    lab.world("arena", options={"radius": "1 m"})
    lab.robot("p", "create2", "kinematic", world="arena", every=3)
    lab.output("log", "csv")
    lab.output("rec", "mcap")
    lab.run(tmp_path / "a", direct=True, show=Show())
    return tmp_path / "a"


def test_the_bytes_of_csv(both: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Robots that begin late, step now and then, and have fields in any order."""
    assert main(["export", str(both / "run.mcap"), "--out", str(both / "made")]) == 0
    made = sorted((both / "made").iterdir())
    assert [path.name for path in made] == ["e.csv", "p.csv", "w.csv", "y.csv"]
    assert len(capsys.readouterr().out.splitlines()) == 4
    for path in made:
        assert path.read_bytes() == (both / path.name).read_bytes(), path.name
    csv, mcap = rems_net.read(both), rems_net.read(both / "run.mcap")
    for name in csv:
        assert [*mcap.table(name)] == [*csv.table(name)]
        for heading, values in csv.table(name).items():
            assert np.array_equal(mcap.table(name)[heading], values), heading


def test_the_bytes_of_csv_from_several_processes(tmp_path: Path) -> None:
    made = carts()
    made.output("rec", "mcap")
    in_a_few(made)
    made.run(tmp_path / "a", show=Show())
    rems_net.read(tmp_path / "a" / "run.mcap").export(folder=tmp_path / "b")
    for path in (tmp_path / "b").iterdir():
        assert path.read_bytes() == (tmp_path / "a" / path.name).read_bytes()


def test_frames_and_parquet(both: Path) -> None:
    found = rems_net.read(both / "run.mcap")
    for library in ("pandas", "polars"):
        pytest.importorskip(library, reason=f"{library} is not installed (an extra)")
        frame = found.frame("w", library)
        assert [*frame.columns] == [*found.table("w")]
        assert frame["state/x [m]"].to_list() == found["w"].plain("state/x").tolist()
    pytest.importorskip("pyarrow", reason="pyarrow is not installed (an extra)")
    (path,) = found.export("p", to="parquet")
    read: Any = importlib.import_module("pyarrow.parquet").read_table(path)
    assert read.column_names == [*found.table("p")]
    for heading, values in found.table("p").items():
        assert read[heading].to_pylist() == values.tolist()


def test_mistakes(both: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = rems_net.read(both / "run.mcap")
    with pytest.raises(UnknownFieldError, match="no recording of 'q'"):
        found.export("q")
    with pytest.raises(ExperimentError, match="no files of kind 'xlsx'"):
        found.export(to="xlsx")
    with pytest.raises(ExperimentError, match="no frames of 'excel'"):
        found.frame("w", "excel")
    with pytest.raises(ExperimentError, match="cannot write into"):
        found.export(folder=both / "run.mcap")
    monkeypatch.setitem(sys.modules, "polars", None)
    with pytest.raises(MissingPartError, match=r"pip install \"rems-net\[frames\]\""):
        found.frame("w", "polars")


def long(path: Path, robots: int, ticks: int) -> None:
    """A file of many robots; one more, `late`, has values in the last tenth only."""
    file = McapWriter(path)
    file.open({"experiment": '"long"', "dt": "0.01", "ticks": str(ticks)})
    keys = [f"robot/r{i}/state" for i in range(robots)]
    file.declare(dict.fromkeys([*keys, "robot/late/state"], STATE))
    for n in range(1, ticks + 1):
        message = cdr(STATE).encode(STATE({"x": n / 7, "heading": -n}))
        messages = dict.fromkeys(keys, message)
        if n > 0.9 * ticks:
            messages["robot/late/state"] = message
        file.add(n, n * 10**7, messages)
        file.end_tick()
    file.close()


#: in a process of its own: the most memory that it has had is that of what it does
MEASURED = """
import sys, time, rems_net
found, begin = rems_net.read(sys.argv[1]), time.process_time()
if sys.argv[2] == "export":
    found.export("r1", "late", folder=sys.argv[3])
else:
    assert len(found[sys.argv[2]].plain("state/x"))
lines = open("/proc/self/status").read().splitlines()
(most,) = [int(line.split()[1]) for line in lines if line.startswith("VmHWM")]
print(most / 1024, time.process_time() - begin)
"""


def measured(path: Path, *what: str) -> tuple[float, float]:
    """Peak memory [MB] and processor time [s] of a reader."""
    words = [sys.executable, "-c", MEASURED, str(path), *what]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, check=True)
    most, seconds = map(float, done.stdout.split())
    return most, seconds


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has /proc/self/status")
@pytest.mark.slow
@pytest.mark.timeout(600)
def test_constant_memory_and_a_time_that_follows_the_chunks(tmp_path: Path) -> None:
    small, large = tmp_path / "small.mcap", tmp_path / "large.mcap"
    long(small, 400, 500)
    long(large, 400, 10_000)
    assert large.stat().st_size > 200e6
    begun = time.monotonic()
    some = {what: measured(small, what, str(tmp_path)) for what in ("r1", "export")}
    many = {what: measured(large, what, str(tmp_path)) for what in ("r1", "export")}
    late = measured(large, "late")
    print(large.stat().st_size / 1e6, some, many, late, time.monotonic() - begun)
    for what in some:
        assert many[what][0] < some[what][0] + 30  # MB; the file has 200 more
    assert late[1] < 0.35 * many["r1"][1]  # a tenth of the chunks, and what is fixed
    rows = (tmp_path / "r1.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 10_001
    assert rows[-1] == f"100.0,{10_000 / 7!r},-10000.0"

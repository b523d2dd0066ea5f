"""Workers that are not like the others, and disks that are full."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest

from rems_net import sweep
from rems_net.errors import ExperimentError
from tests.agents.runs import until
from tests.commands import environment
from tests.sweeps.labs import lab, written


class Editing(ThreadPoolExecutor):
    """Executor during whose second call a user saves a source."""

    def __init__(self, file: Path) -> None:
        super().__init__(1)
        self.file, self.calls = file, 0

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Save it before the call."""
        self.calls += 1
        if self.calls == 2:
            # At once: the worker of the first call may be reading it.
            saved = self.file.with_suffix(".saved")
            saved.write_text(self.file.read_text() + "\n# changed\n")
            until(lambda: _replace(self.file, saved))
        return super().submit(fn, *args)


def _replace(file: Path, saved: Path) -> bool:
    """Return whether a file got its place; Windows keeps a file that is being read."""
    try:
        saved.replace(file)
    except PermissionError:
        return False
    return True


def test_a_source_that_differs_on_a_worker(tmp_path: Path) -> None:
    made = lab(tmp_path / "lab")
    editing = Editing(tmp_path / "lab" / "swept.py")
    with editing, pytest.raises(ExperimentError) as refused:
        sweep(made, seeds=3, out=tmp_path / "s", executor=editing)
    assert "swept.py differs there and on" in str(refused.value)
    assert "(R1024)" in str(refused.value)


def _without_mujoco() -> None:
    sys.modules["mujoco"] = None  # type: ignore[assignment]


def test_a_worker_without_the_driver(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="mujoco is not installed (an extra)")
    lacks = ProcessPoolExecutor(1, get_context("spawn"), _without_mujoco)
    path = tmp_path / "lab.toml"
    path.write_text(
        '[experiment]\nduration = "1 s"\n[[robot]]\nname = "sim"\n'
        'definition = "woodbot"\ndriver = "kinematic"\n'
    )
    with lacks, pytest.raises(ExperimentError) as refused:
        sweep(path, {"robot/sim": ["mujoco"]}, out=tmp_path / "s", executor=lacks)
    assert "the library mujoco is not installed there" in str(refused.value)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no limit on a file's size")
@pytest.mark.parametrize("where", ["own", "worker", "sweep"])
def test_a_full_disk(tmp_path: Path, where: str) -> None:
    """A limit on the size of files is the disk; a long input makes a large file."""
    path = written(tmp_path / "lab")
    text = path.read_text().replace('"swept.py:Weave"', '"csv"')
    path.write_text(
        text.replace('duration = "1 s"\n', "record = false\n").replace(
            'type = "csv"\n\n[[robot]]',
            'type = "csv"\noptions = { file = "a.csv" }\n\n[[robot]]',
        )
    )
    head = "time [s],command/speed [m/s],command/turn [rad/s]\n"
    (tmp_path / "lab" / "a.csv").write_text(f"{head}1.0,1,1\n")
    (tmp_path / "lab" / "b.csv").write_text(f"{head}60.0,1,1\n")
    done = subprocess.run(
        [sys.executable, "-c", FULL, where, str(path), "40000"],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    assert " run 3" in done.stdout
    assert "type the same command again" in done.stdout
    assert done.stdout.endswith("(R1025)\n2 of 4 runs are there.\n")
    assert done.stdout.count("\n") == 2
    left = sorted(path.name for path in (tmp_path / "s").iterdir())
    assert left == ["001", "002", "sweep.json", "table.csv"]
    values = {"input/weave.file": ["a.csv", "a.csv", "b.csv", "a.csv"]}
    again = sweep(path, values, out=tmp_path / "s", workers=1)
    assert again.table["ticks"].tolist() == [20, 20, 1200, 20]


FULL = """
import resource, sys
from rems_net import sweep
from rems_net.errors import ExperimentError
from rems_net.sweeps.pool import Pool

if __name__ == "__main__":
    where, path, most = sys.argv[1:]
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    with Pool(1) as pool:
        if where == "sweep":
            pool.submit(len, "x").result()  # its process has no limit
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(most), hard))
        values = {"input/weave.file": ["a.csv", "a.csv", "b.csv", "a.csv"]}
        try:
            given = {"workers": 1} if where == "own" else {"executor": pool}
            sweep(path, values, out="s", **given)
        except ExperimentError as error:
            print(error, *getattr(error, "__notes__", ()), sep="\\n")
"""

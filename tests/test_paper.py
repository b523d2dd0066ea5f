"""As in the paper: ten robots of eight kinds in one experiment, three at real lines."""

from __future__ import annotations

import csv
import os
import shutil
import subprocess
import sys
from math import dist
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SCRIPT = ROOT / "examples" / "as_in_the_paper.py"
SIMULATED, DEVICES = 7, 3
#: ticks that pass until a device has heard the first command
BEGINS = 5


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the example has left."""
    for library in ("mujoco", "serial", "dynamixel_sdk", "websockets", "pty"):
        pytest.importorskip(library, reason=f"{library} is not here")
    folder = tmp_path_factory.mktemp("paper")
    shutil.copy(SCRIPT, folder)
    done = subprocess.run(
        [sys.executable, "-W", "error", SCRIPT.name],
        cwd=folder,
        # Where devices are emulated, unless it is said.
        env=os.environ | {"PYTHONPATH": str(ROOT), "TMPDIR": str(folder)},
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    return folder / "runs"


def columns(path: Path) -> dict[str, list[float]]:
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [float(row[name]) for row in rows] for name in rows[0]}


def told(path: Path) -> list[float]:
    """The left wheel's speed, as a share of the fastest that it was told."""
    found = columns(path)
    name = next(n for n in found if n.startswith("command/wheel/") and "left" in n)
    most = max(found[name])
    return [round(speed / most, 6) for speed in found[name]]


@pytest.mark.slow
@pytest.mark.parametrize("run", ["one_input", "own_inputs"])
def test_all_ten_drive(runs: Path, run: str) -> None:
    files = sorted((runs / run).glob("*.csv"))
    assert len(files) == SIMULATED + DEVICES
    for path in files:
        found = columns(path)
        x, y = found["state/x [m]"], found["state/y [m]"]
        assert len(x) == 40
        assert dist((x[-1], y[-1]), (x[0], y[0])) > 0.01, path.stem


@pytest.mark.slow
def test_all_by_one_input(runs: Path) -> None:
    """In the same tick the same; a device may have it a tick or two later."""
    found = {path.stem: told(path) for path in (runs / "one_input").glob("*.csv")}
    devices = {name: found.pop(name) for name in [*found] if name.endswith("-real")}
    first, *others = found.values()
    assert all(other == first for other in others)
    for name, told_here in devices.items():
        assert {*told_here[BEGINS:]} <= {*first}, name


@pytest.mark.slow
def test_each_by_its_own(runs: Path) -> None:
    found = [told(path) for path in (runs / "own_inputs").glob("*.csv")]
    assert len({tuple(one) for one in found}) == SIMULATED + DEVICES

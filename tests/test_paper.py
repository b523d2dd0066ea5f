"""As in the paper: ten robots of eight kinds in one experiment, three at real lines."""

import shutil
import sys
from collections.abc import Mapping
from math import dist
from pathlib import Path
from typing import Any

import pytest

from rems_net import read
from tests.commands import ROOT, environment, finished, rems

SCRIPT = ROOT / "examples" / "as_in_the_paper.py"
SIMULATED, DEVICES = 7, 3
#: how fast a youBot's wheels go where it turns about, m/s per rad/s
LEVER = (0.456 + 0.316) / 2
#: ticks that pass until a device has heard the first command
BEGINS = 5


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the example has left."""
    for library in ("mujoco", "serial", "dynamixel_sdk", "websockets", "pty"):
        pytest.importorskip(library, reason=f"{library} is not here")
    folder = tmp_path_factory.mktemp("paper")
    shutil.copy(SCRIPT, folder)
    words = [sys.executable, "-W", "error", SCRIPT.name]
    # Where devices are emulated, unless it is said.
    done = finished(words, folder, environment(TMPDIR=str(folder)), seconds=100)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    return folder / "runs"


def told(columns: Mapping[str, Any]) -> list[float]:
    """A left wheel's speed, as a share of the fastest that it was told."""
    found = {n.split(" ")[0]: columns[n] for n in columns if n.startswith("command/")}
    if "command/wheel/left" in found:
        left = found["command/wheel/left"]
    else:  # a youBot's, at its rim
        left = found["command/linear/x"] - LEVER * found["command/angular/z"]
    return [round(float(speed / max(left)), 6) for speed in left]


@pytest.mark.slow
@pytest.mark.parametrize("run", ["one_input", "own_inputs"])
def test_all_ten_drive(runs: Path, run: str) -> None:
    found = read(runs / run)
    assert len(found) == SIMULATED + DEVICES
    for robot in found:
        x, y = (found.table(robot)[name] for name in ("state/x [m]", "state/y [m]"))
        assert len(x) == 40
        assert dist((x[-1], y[-1]), (x[0], y[0])) > 0.01, robot


@pytest.mark.slow
def test_all_by_one_input(runs: Path) -> None:
    """In the same tick the same; a device may have it a tick or two later."""
    recording = read(runs / "one_input")
    found = {robot: told(recording.table(robot)) for robot in recording}
    devices = {name: found.pop(name) for name in [*found] if name.endswith("-real")}
    first, *others = found.values()
    assert all(other == first for other in others)
    for name, told_here in devices.items():
        assert {*told_here[BEGINS:]} <= {*first}, name


@pytest.mark.slow
def test_each_by_its_own(runs: Path) -> None:
    recording = read(runs / "own_inputs")
    found = {tuple(told(recording.table(robot))) for robot in recording}
    assert len(found) == SIMULATED + DEVICES


@pytest.mark.slow
@pytest.mark.parametrize("run", ["one_input", "own_inputs"])
def test_why_ten_part_is_readable(runs: Path, run: str) -> None:
    """Of 45 pairs nine are told, against the first robot; in two lines each, or so."""
    done = rems(runs, "compare", run)
    assert (done.returncode, done.stderr) == (0, "")
    assert all(len(line) <= 80 for line in done.stdout.splitlines())
    *_, table, why = done.stdout.split("\n\n")
    others = [name for name in read(runs / run) if name != "create2"]
    assert [line.split()[0] for line in table.splitlines()[2:]] == others
    told = [line for line in why.splitlines()[1:-1] if not line.startswith(" ")]
    assert [line.split()[0] for line in told] == others
    assert len(why.splitlines()) <= 2 + 3 * len(others)


@pytest.mark.slow
def test_why_a_device_parts_from_its_simulation(runs: Path) -> None:
    """Its first command comes late to it, and nothing else is far wrong."""
    found = read(runs / "one_input").why("create2", "create2-real")
    assert {"later", "told"} & {cause.kind for cause in found.causes}
    assert found.causes[-1].share > 0.8

"""Faults, one trial each: what was recorded is there, and the run does as it says."""

import re
import shutil
from pathlib import Path

import pytest

from tests.reliability import faults, one_machine
from tests.reliability.rig.rig import MACHINES

pytestmark = MACHINES


@pytest.mark.parametrize("row", faults.ROWS, ids=[row.title for row in faults.ROWS])
def test_a_fault(tmp_path: Path, row: faults.Row) -> None:
    (found,) = faults.measure([row], 1, tmp_path)
    assert found.kept == [True]
    assert all(found.same)
    assert bool(found.same) == (row.same and row.then == "goes on")
    assert found.said


def test_the_same_with_a_full_disk(tmp_path: Path) -> None:
    stop = one_machine.full_disk(tmp_path / "stop", "stop")
    assert (stop.then, stop.kept) == ("ends", [True])
    assert re.fullmatch(
        r"output/log: cannot write (one|two)\.csv: No space left on device", stop.said
    )
    drop = one_machine.full_disk(tmp_path / "drop", "drop")
    assert (drop.then, drop.kept) == ("goes on", [True])
    assert "; dropped at tick " in drop.said


def test_too_few_files(tmp_path: Path) -> None:
    found = one_machine.few_files(tmp_path)
    assert found.kept == [True]
    assert "Type `ulimit -n 1024` first" in found.said


@pytest.mark.skipif(not shutil.which("cc"), reason="there is no C compiler (cc)")
@pytest.mark.parametrize("seconds", [3600, -3600])
def test_another_system_time(tmp_path: Path, seconds: int) -> None:
    found = one_machine.system_time(tmp_path, seconds)
    assert (found.kept, found.same) == ([True], [True])

"""A student's first hour, under Wine: the README's commands, one by one."""

from pathlib import Path

import pytest

from tests.windows.wine import Windows

pytestmark = [pytest.mark.wine, pytest.mark.timeout(300)]


def test_the_demo(windows: Windows, tmp_path: Path) -> None:
    printed = windows.rems("demo", cwd=tmp_path)
    assert r"picture  runs\demo\comparison.png" in printed
    assert {path.name for path in (tmp_path / "runs" / "demo").iterdir()} >= {
        "kinematic.csv",
        "mujoco.csv",
        "run.mcap",
        "comparison.png",
    }

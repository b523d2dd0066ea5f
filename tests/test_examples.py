"""Every example is one idea in at most 25 lines, and runs."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
EXAMPLES = ROOT / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
FILES = sorted(EXAMPLES.glob("*.toml"))


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A folder to run them in, as a user would have it."""
    return Path(shutil.copytree(EXAMPLES, tmp_path / "examples"))


def run(folder: Path, *args: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-W", "error", *args],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_script(copy: Path, path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for library in ("mujoco", "pybullet"):
        if f'"{library}"' in text and not find_spec(library):
            pytest.skip(f"{library} is not installed")
    done = run(copy, path.name)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    if '"csv")' in text:
        for made in (copy / "runs").glob("*/*.csv"):
            assert len(made.read_text().splitlines()) > 10


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_one_idea(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 25
    assert lines[0].startswith('"""')


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_file(copy: Path, path: Path) -> None:
    done = run(copy, "-m", "rems_net.cli", "run", path.name, "--pace", "fast")
    assert (done.returncode, done.stderr) == (0, "")
    assert (copy / "runs" / path.stem).is_dir()


def test_the_experiment_takes_fifteen_lines(copy: Path) -> None:
    """The experiment of a file takes no more in Python."""
    script = (copy / "three_drivers.py").read_text().splitlines()
    assert len([line for line in script if line.strip()]) <= 15

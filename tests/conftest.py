"""What every test gets: a fabric of its own, that no other test can find."""

from __future__ import annotations

import compileall
import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def pytest_configure(config: pytest.Config) -> None:
    """Compile what hundreds of processes will import, before any of them starts.

    Else each does so for itself where PYTHONDONTWRITEBYTECODE is set, as in containers.
    """
    if not hasattr(config, "workerinput"):
        for folder in ("rems_net", "tests"):
            compileall.compile_dir(ROOT / folder, quiet=1)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Two more than there are cores: most tests wait for what they have started."""
    return (os.cpu_count() or 1) + 2


@pytest.fixture(autouse=True)
def own_fabric(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Routers leave their notes in a folder of this test only."""
    folder = tmp_path / "runtime"
    folder.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(folder))
    # ...and what a user has joined is forgotten; Windows and macOS look elsewhere
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("APPDATA", str(tmp_path / "config"))
    monkeypatch.delenv("REMS_ROUTER", raising=False)

"""A scene of the posix port's own suite, with the shared library in its place."""

import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.firmware.emulated.scene import compiled
from tests.firmware.posix.scene import Scene
from tests.reliability.rig.rig import Rig

MODULE = "tests.firmware.emulated.process"


@pytest.fixture
def scene(tmp_path: Path) -> Iterator[Scene]:
    """An open fabric, and nothing on it yet."""
    if sys.platform == "win32":
        pytest.skip("Windows can't freeze a router, nor start a script as a program.")
    compiled()
    program = tmp_path / "woodbot-library"
    python = shlex.quote(sys.executable)
    program.write_text(f'#!/bin/sh\nexec {python} -m {MODULE} "$@"\n', encoding="utf-8")
    program.chmod(0o700)
    with Rig(tmp_path / "rig") as rig:
        scene = Scene(rig, program)
        yield scene
        scene.close()

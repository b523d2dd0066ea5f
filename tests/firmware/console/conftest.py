"""A robot at a cable, for each test one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.firmware.console.robot import CONSOLE, Robot, build


@pytest.fixture(scope="session")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("console"), "test_console", CONSOLE)


@pytest.fixture
def robot(program: Path, tmp_path: Path) -> Iterator[Robot]:
    made = Robot(program, tmp_path / "settings")
    try:
        yield made
    finally:
        made.close()

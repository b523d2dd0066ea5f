"""A robot at a cable, for each test one."""

import re
import shutil
import subprocess
import tarfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.firmware.console.robot import CONSOLE, Robot, build

#: Improv's own client for browsers; it is fetched for a test, and never kept here
SDK = "improv-wifi-serial-sdk@2.8.1"


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


@pytest.fixture(scope="session")
def client(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Improv's client, fetched into a folder of this test, as modules that node takes.

    It is written for bundlers: imports lack their endings, and the package its type.
    """
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("There is no npm here, which fetches Improv's own client.")
    folder = tmp_path_factory.mktemp("sdk")
    try:
        done = subprocess.run(
            [npm, "pack", SDK], cwd=folder, capture_output=True, timeout=60, check=False
        )
    except subprocess.TimeoutExpired:
        pytest.skip(f"npm does not fetch {SDK} within a minute.")
    if done.returncode != 0:
        pytest.skip(f"npm does not fetch {SDK}: is its registry reached from here?")
    with tarfile.open(next(folder.glob("*.tgz"))) as packed:
        packed.extractall(folder, filter="data")
    (folder / "package" / "package.json").write_text('{"type": "module"}')
    made = folder / "package" / "dist"
    for file in made.rglob("*.js"):
        text = file.read_text(encoding="utf-8")
        text = re.sub(r'(from "\./[^"]*?)(?<!\.js)"', r'\1.js"', text)
        file.write_text(text, encoding="utf-8")
    return made / "serial.js"

"""A robot at a cable, for each test one."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.commands import fetched
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
    package = fetched(tmp_path_factory.mktemp("sdk"), SDK) / SDK.partition("@")[0]
    (package / "package.json").write_text('{"type": "module"}')
    made = package / "dist"
    for file in made.rglob("*.js"):
        text = file.read_text(encoding="utf-8")
        text = re.sub(r'(from "\./[^"]*?)(?<!\.js)"', r'\1.js"', text)
        file.write_text(text, encoding="utf-8")
    return made / "serial.js"

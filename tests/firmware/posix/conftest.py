"""The Woodbot as a process: built once for all tests, and all their workers."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.firmware.posix.building import NAME, build, missing
from tests.firmware.posix.scene import Scene
from tests.reliability.rig.programs import until
from tests.reliability.rig.rig import Rig


@pytest.fixture(scope="session")
def woodbot(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """The program, or a skip that says what is missing."""
    if words := missing():
        pytest.skip(words)
    base = tmp_path_factory.getbasetemp()
    folder = (base if worker_id == "master" else base.parent) / "woodbot-posix"
    outcome = folder / "outcome"
    try:
        folder.mkdir()
    except FileExistsError:  # another worker builds it
        until(outcome.exists, "the program that another worker builds", 300.0)
    else:
        try:
            _, words = build(folder)
        except RuntimeError as error:
            words = f"failed: {error}"
        written = folder / "writing"
        written.write_text(words, encoding="utf-8")
        written.rename(outcome)
    words = outcome.read_text(encoding="utf-8")
    if words.startswith("failed: "):
        pytest.fail(words)
    if words:
        pytest.skip(words)
    return folder / NAME


@pytest.fixture
def scene(woodbot: Path, tmp_path: Path) -> Iterator[Scene]:
    """An open fabric, and nothing on it yet."""
    with Rig(tmp_path / "rig") as rig:
        scene = Scene(rig, woodbot)
        yield scene
        scene.close()

"""What is no file, never ends or is too large is refused before it is read."""

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from rems_net.agents.experiment.file import load
from rems_net.agents.world import World
from rems_net.bodies.files.built import read as read_model
from rems_net.bodies.files.meshes import corners, made_binary
from rems_net.bodies.model import Model
from rems_net.errors import RemsError
from rems_net.recordings.csv_file import CsvFile
from rems_net.recordings.manifest import LONGEST, NAME, read_manifest
from rems_net.router.gate import classlist, users
from rems_net.scenes.description import described
from rems_net.system.reading import DESCRIPTION, MESH, TABLE, read_file

#: each reader of files that a user names, and the most bytes that it reads
READERS: dict[str, tuple[Callable[[Path], object], int]] = {
    "table.csv": (CsvFile, TABLE),
    "lab.toml": (load, DESCRIPTION),
    "arm.urdf": (lambda path: read_model(Model(path)), DESCRIPTION),
    "room.xml": (
        lambda path: described(World.options.schema({"mjcf": path.name}), path.parent),
        DESCRIPTION,
    ),
    "mesh.obj": (corners, MESH),
    "mesh.stl": (made_binary, MESH),
    "class.csv": (lambda path: classlist.load_class(path, "rems"), DESCRIPTION),
    "users.toml": (users.load, DESCRIPTION),
}
#: s. A reader that begins to read takes longer, or never returns.
SOON = 2.0


unix = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows has no files like /dev/zero"
)


@pytest.mark.parametrize("name", READERS)
def test_no_device_pipe_or_huge_file_is_read(name: str, tmp_path: Path) -> None:
    reader, most = READERS[name]
    path = tmp_path / name
    huge = tmp_path / "huge"
    with huge.open("wb") as file:
        file.truncate(most + 1)  # takes no room on a disk
    sentences = {huge: f"it is too large; expected at most {most // 2**20} MB"}
    if sys.platform != "win32":
        os.mkfifo(tmp_path / "pipe")
        for special in (Path("/dev/zero"), tmp_path / "pipe"):
            sentences[special] = "it is a device or a pipe; expected a file on a disk"
    for target, sentence in sentences.items():
        path.unlink(missing_ok=True)
        if target == huge:
            path.hardlink_to(target)  # a symbolic link needs rights on Windows
        else:
            path.symlink_to(target)
        begun = time.process_time()
        with pytest.raises(RemsError) as caught:
            reader(path)
        assert sentence in str(caught.value)
        assert time.process_time() - begun < SOON


@unix
def test_a_run_that_says_too_much_of_itself_is_no_run(tmp_path: Path) -> None:
    (tmp_path / NAME).symlink_to("/dev/zero")
    assert read_manifest(tmp_path) is None
    assert LONGEST < TABLE


@unix
def test_a_file_of_the_system_that_says_it_is_empty() -> None:
    """Its size is 0, and there is something in it; so what comes is counted, too."""
    assert b"MemTotal" in read_file(Path("/proc/meminfo"), 100_000)
    with pytest.raises(OSError, match="too large"):
        read_file(Path("/proc/meminfo"), 10)

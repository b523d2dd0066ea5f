"""Which files go to another machine with an agent, and which never do."""

from contextlib import suppress
from pathlib import Path

import pytest

from rems_net import Process, Settings
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.experiment.placement.needs import code_of, data_of
from rems_net.agents.experiment.placement.offers import make_offers
from rems_net.agents.protocol import limits
from rems_net.agents.registry import load_file
from rems_net.defdict import text
from rems_net.errors import ExperimentError
from rems_net.inputs.csv import CsvInput


class Reads(Process):
    options = Settings(model=text(max_len=400), note=text(max_len=400))


def reads(model: str, note: str = "") -> Reads:
    return Reads("reads", options={"model": model, "note": note})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An experiment's folder, with a model, its meshes, and what is nobody's."""
    here = tmp_path / "here"
    for name in (
        "arm/arm.xml",
        "arm/meshes/link.stl",
        "arm/meshes/skin.png",
        "arm/.cache/old.stl",
        "arm/build.py",
        "notes.txt",
        "mine.csv",
        "lab.py",
    ):
        (here / name).parent.mkdir(parents=True, exist_ok=True)
        (here / name).write_text(name)
    (tmp_path / "secret.txt").write_text("secret")
    with suppress(OSError):  # on Windows only some users can make links
        (here / "link.txt").symlink_to(tmp_path / "secret.txt")
        (here / "arm" / "far.stl").symlink_to(tmp_path / "secret.txt")
    return here


def test_a_model_comes_with_what_is_beside_it(folder: Path) -> None:
    found = data_of(reads("arm/arm.xml", "notes.txt"), folder)
    assert sorted(found) == [
        "arm/arm.xml",
        "arm/meshes/link.stl",
        "arm/meshes/skin.png",
        "notes.txt",
    ]


@pytest.mark.parametrize("text", ["", "arm", "no such file", "a\0b", "x" * 300, "/dev"])
def test_a_setting_that_names_no_file(folder: Path, text: str) -> None:
    assert data_of(reads("", text), folder) == {}


REFUSED = {
    "../secret.txt": "which is not below the experiment's folder",
    "link.txt": "which is not below the experiment's folder",
    "lab.py": "expected one that ends with csv, ",
    "arm/.cache/old.stl": "expected a name below the folder",
    "arm/../notes.txt": "is found on this machine only; write 'notes.txt'",
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_that_stays(folder: Path, name: str) -> None:
    if name == "link.txt" and not (folder / name).is_symlink():
        pytest.skip("Windows has no links for this user")
    with pytest.raises(ExperimentError) as caught:
        data_of(reads("", name), folder)
    assert REFUSED[name] in str(caught.value)


def test_an_absolute_name_is_found_on_this_machine_only(folder: Path) -> None:
    with pytest.raises(ExperimentError, match=r"write 'notes\.txt'"):
        data_of(reads("", str(folder / "notes.txt")), folder)


def test_too_many_files_are_not_read(folder: Path) -> None:
    for i in range(limits.SENT + 1):
        (folder / "arm" / f"{i}.stl").touch()
    lab = Lineup(folder=folder)
    lab.input("keys", CsvInput, options={"file": "arm/arm.xml"})
    keys = CsvInput("keys", options={"file": "arm/arm.xml"})
    with pytest.raises(ExperimentError, match=r"machine b would be sent 204 files of"):
        make_offers(lab, {keys.key: keys}, {keys.key: "b"})


def test_code_is_what_is_imported_from_below(folder: Path) -> None:
    (folder / "follow.py").write_text("import json\nfrom needs_one import two\n")
    (folder / "needs_one.py").write_text("import needs_three\ntwo = 2\n")
    (folder / "needs_three.py").write_text("")
    load_file(folder / "follow.py")
    found = code_of(folder / "follow.py", folder.resolve())
    assert sorted(found) == ["follow.py", "needs_one.py", "needs_three.py"]

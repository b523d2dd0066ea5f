"""The same experiments on Linux and under Wine, in one process and in several."""

import csv
import hashlib
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from rems_net.maths.numerics import environment
from tests.commands import ROOT, environment as terminal
from tests.windows.experiments import LABS
from tests.windows.wine import Windows

pytestmark = [pytest.mark.wine, pytest.mark.slow, pytest.mark.timeout(600)]
EXACT = [(lab, word) for lab in LABS if lab != "physics" for word in LABS[lab]]
WAYS = ("one", "many")
#: m, rad. MuJoCo's library for Windows rounds otherwise: so far apart after 2 s, even
#: if balls are pushed.
MUJOCO = 1e-11
PROGRAM = "-W", "error", "-m", "tests.windows.experiments"
#: a definition in a file beside it, units, percent, noise
OWN = """\
from rems_net import Definition, Input, In, Out, Schema, sin
from rems_net.units import length, percent, velocity

class Slider(Definition):
    command = In(Schema("command", {"speed": velocity(range=(-0.1, 0.1))}))
    state = Out(Schema("state", {"x": length()}))

    def derivative(self, state, command):
        return {"x": command["speed"]}

class Hand(Input):
    value = Out(Schema("hand", {"speed": percent()}))

    def read(self, tick):
        return {"speed": 50 * sin(tick.t) + self.random.gauss(0, 1)}
"""
LAB = """\
experiment = { name = "own", dt = "20 ms", duration = "3 s", seed = 3 }
input = [{ name = "hand", type = "own.py:Hand" }]
output = [{ name = "log", type = "csv" }]

[[robot]]
name = "slider"
definition = "own.py:Slider"
driver = "kinematic"
command = "input/hand"
initial = { x = "1 mm" }
"""
SWEEP = "--set", "robot/slider.x=0..1cm/3", "--seeds", "2", "--workers", "2"


class Recorded(NamedTuple):
    """What both systems recorded, by system: a folder, and versions of libraries."""

    folder: dict[str, Path]
    versions: dict[str, str]

    def digest(self, system: str, way: str, pattern: str) -> str:
        """Return one SHA-256 over names and bytes of the files."""
        total = hashlib.sha256()
        files = sorted((self.folder[system] / way).glob(pattern))
        assert files, pattern
        for file in files:
            total.update(file.name.encode() + b"\0" + file.read_bytes())
        return total.hexdigest()

    def digests(self, pattern: str) -> dict[str, str]:
        """Return one of each system and way."""
        return {
            f"{system}, {way}": self.digest(system, way, pattern)
            for system in self.folder
            for way in WAYS
        }


@pytest.fixture(scope="module")
def recorded(windows: Windows, tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """All experiments, on both systems at the same time."""
    folder = tmp_path_factory.mktemp("bytes")
    here, there = folder / "linux", folder / "windows"
    pinned = environment(terminal())
    with subprocess.Popen(
        [sys.executable, *PROGRAM, here], stdout=subprocess.PIPE, env=pinned, text=True
    ) as process:
        printed = windows.python(*PROGRAM, there, cwd=ROOT, seconds=500)
        ours, _ = process.communicate()
    assert process.returncode == 0
    lines = [re.findall("^Python .*", text, re.M)[0] for text in (ours, printed)]
    assert lines[0].split("MuJoCo")[1] == lines[1].split("MuJoCo")[1]
    systems = "Linux", "Windows"
    return Recorded(
        dict(zip(systems, (here, there), strict=True)),
        dict(zip(systems, lines, strict=True)),
    )


@pytest.mark.parametrize(("lab", "word"), EXACT, ids=[word for _, word in EXACT])
def test_tables(recorded: Recorded, lab: str, word: str) -> None:
    found = recorded.digests(f"{lab}/*{word}*.csv")
    assert len({*found.values()}) == 1, (found, recorded.versions)


@pytest.mark.parametrize("lab", [lab for lab in LABS if lab != "physics"])
def test_whole_recordings(recorded: Recorded, lab: str) -> None:
    """With the settings, sources and schemas that they have of their experiment."""
    found = recorded.digests(f"{lab}/run.mcap")
    assert len({*found.values()}) == 1, (found, recorded.versions)


@pytest.mark.parametrize("pattern", ["physics/*.csv", "physics/run.mcap"])
def test_mujoco_agrees_on_one_system(recorded: Recorded, pattern: str) -> None:
    found = recorded.digests(pattern)
    for system in recorded.folder:
        assert found[f"{system}, one"] == found[f"{system}, many"]


def test_mujoco_on_two_systems_is_as_near_as_the_page_says(recorded: Recorded) -> None:
    worst, names = 0.0, 0
    for file in (recorded.folder["Linux"] / "one" / "physics").glob("*.csv"):
        other = recorded.folder["Windows"] / "one" / "physics" / file.name
        pairs = zip(numbers(file), numbers(other), strict=True)
        worst = max(worst, *(abs(a - b) for a, b in pairs))
        names += 1
    assert names == 6
    assert worst < MUJOCO, f"MuJoCo differs by {worst:.1g}: {recorded.versions}"


def numbers(file: Path) -> Iterator[float]:
    """Yield the numbers of a table, in their order: poses, and angles."""
    with file.open(encoding="utf-8", newline="") as text:
        for row in csv.DictReader(text):
            for name, cell in row.items():
                if name.startswith(("state/", "pose/", "ball")) and cell:
                    yield float(cell)


def test_files_by_commands(windows: Windows, tmp_path: Path) -> None:
    """Run in both ways, done again on the other system, and swept."""
    mine = terminal(XDG_RUNTIME_DIR=str(tmp_path / "notes"))
    rows: dict[str, list[bytes]] = {}
    for system in ("linux", "windows"):
        folder = tmp_path / system
        folder.mkdir()
        (folder / "own.py").write_text(OWN, encoding="utf-8")
        (folder / "lab.toml").write_text(LAB, encoding="utf-8")

        def rems(*words: str | Path, cwd: Path = folder, here: str = system) -> str:
            if here == "windows":
                return windows.rems(*words, cwd=cwd)
            command = [sys.executable, "-W", "error", "-m", "rems_net", *words]
            return subprocess.check_output(command, cwd=cwd, env=mine, text=True)

        rems("run", "lab.toml", "--direct", "--out", "one")
        rems("run", "lab.toml", "--alone", "--out", "many")
        rems("sweep", "lab.toml", *SWEEP, "--out", "swept")
        files = ["one/slider.csv", "one/run.mcap", "many/slider.csv", "many/run.mcap"]
        runs = [f"swept/00{n}/slider.csv" for n in range(1, 7)]
        names = [*files, "swept/table.csv", *runs]
        rows[system] = [(folder / name).read_bytes() for name in names]
        # a recording of the other system, with the files of this one
        printed = rems("rerun", tmp_path / "linux" / "one")
        assert "same" in printed, printed
    assert rows["linux"] == rows["windows"]
    assert rows["linux"][:2] == rows["linux"][2:4]
    saved = json.loads((tmp_path / "windows/one/run.json").read_text("utf-8"))
    assert "Windows" in saved["numerics"]
    assert os.sep not in "".join(saved["files"])

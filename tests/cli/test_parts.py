"""`rems show`; and the package of docs/parts.md, built, installed and run."""

import json
import os
import re
import shutil
import sys
from itertools import chain
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.registry import BUILT_IN
from rems_net.cli import main
from tests import commands
from tests.cli.complaint import complaint
from tests.commands import ROOT, Run, finished

ROVER = ROOT / "docs" / "rover"


def names(*brought: str) -> str:
    """The names of all parts: the built-in ones and these."""
    return ", ".join(sorted({*brought, *chain.from_iterable(BUILT_IN.values())}))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where pip has installed the package of docs/parts.md, without a network."""
    work = tmp_path_factory.mktemp("rover")
    source = shutil.copytree(ROVER, work / "source")
    options = ["--no-build-isolation", "--no-index", "--no-deps", "--quiet"]
    options += ["--disable-pip-version-check", "--target", str(work / "site")]
    done = finished([sys.executable, "-m", "pip", "install", *options, str(source)])
    assert done.returncode == 0, done.stderr
    return work / "site"


@pytest.fixture
def installed(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The package is installed here, too."""
    monkeypatch.syspath_prepend(str(site))


def said(capsys: pytest.CaptureFixture[str], *args: str) -> str:
    assert main(args) == 0
    told = capsys.readouterr()
    assert told.err == ""
    assert "--json" in args or max(map(len, told.out.splitlines())) <= 80
    return "\n".join(line.rstrip() for line in told.out.splitlines())


def test_a_package_that_brings_one_part_of_each_kind(
    folder: Path, site: Path, rems: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Definition, driver, input, process and output run, each in its own process."""
    shutil.copy(ROVER / "rovers.toml", folder)
    path = os.pathsep.join([str(ROOT), str(site)])
    done = commands.rems(folder, "run", "rovers.toml", PYTHONPATH=path)
    assert (done.returncode, done.stderr) == (0, "")
    lines = (folder / "runs" / "rovers" / "notes.txt").read_text().splitlines()
    assert len(lines) == 50
    # 0.2 m/s, slowed down to 0.8 of it, and a fifth of that lost: 0.128 m/s at first
    assert lines[1] == "0.2 s: x = 0.013 m"

    monkeypatch.syspath_prepend(str(site))
    listed = commands.rems(folder, "show", "rover", PYTHONPATH=path)
    assert (listed.returncode, listed.stderr) == (0, "")
    checked = rems("check", "rovers.toml")
    assert (checked.returncode, checked.stderr) == (0, "")
    assert "robot/a  Rover done by Slipping" in checked.stdout


@pytest.mark.usefixtures("installed")
def test_it_is_found_by_a_script_too(folder: Path, rems: Run) -> None:
    (folder / "rovers.py").write_text(
        "from rems_net import Experiment\n\n"
        'lab = Experiment("rovers", duration="1 s")\n'
        'lab.input("hand", "circle")\n'
        'lab.robot("a", "rover", "slipping", command="input/hand")\n'
        'lab.output("log", "csv")\n'
        "lab.run()\n"
    )
    done = rems("run", "--direct", "rovers.py")
    assert (done.returncode, done.stderr) == (0, "")
    assert len((folder / "runs/rovers/a.csv").read_text().splitlines()) == 11


@pytest.mark.usefixtures("installed")
def test_it_is_listed_with_its_origin(rems: Run) -> None:
    done = rems("show")
    assert (done.returncode, done.stderr) == (0, "")
    assert max(map(len, done.stdout.splitlines())) <= 80
    lines = [" ".join(line.split()) for line in done.stdout.splitlines()]
    for line in (
        "rover A cart that is told how fast to drive and to turn. rover 1.0",
        "circle Drives in a circle. rover 1.0",
        "calm Passes a command on, slowed down. rover 1.0",
        "diary Writes a line per step, for people to read. rover 1.0",
        "csv Plays a CSV file. built-in",
    ):
        assert line in lines
    heads = [line.strip() for line in done.stdout.splitlines() if line[:1] != " "]
    kinds = ["definitions", "drivers", "inputs", "processes", "outputs", "worlds"]
    assert heads == kinds


@pytest.mark.usefixtures("installed")
def test_the_nearest_name_is_suggested(rems: Run) -> None:
    done = rems("show", "rovr")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "rems: There is no part 'rovr'; there is "
        f"{names('calm', 'circle', 'diary', 'rover', 'slipping')}, or your own as "
        "'my_file.py:MyClass'. Did you mean 'rover'? (R0425)\n"
    )


def bring(site: Path, name: str, points: str) -> None:
    """An installed package, as it lies on the disk."""
    info = site / f"{name}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n"
    )
    (info / "entry_points.txt").write_text(points)


def test_a_broken_part_is_listed_as_broken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    bring(tmp_path / "site", "lag", "[rems_net.drivers]\nlag = plug_gone:Lagging\n")
    bring(tmp_path / "site", "twin", "[rems_net.inputs]\ncsv = plug_gone:Csv\n")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    words = " ".join(said(capsys, "show").split())
    assert " lag broken: The driver 'lag' of lag 1.0 cannot be" in words
    assert " csv Plays a CSV file. (The name is taken twice:" in words
    rows = json.loads(said(capsys, "show", "--json"))
    (lag,) = [row for row in rows if row["name"] == "lag"]
    assert lag == {
        "kind": "driver",
        "name": "lag",
        "class": "plug_gone:Lagging",
        "origin": "lag 1.0",
        "doc": "",
        "missing": [],
        "problem": "The driver 'lag' of lag 1.0 cannot be used: Cannot import "
        "'plug_gone': No module named 'plug_gone'. (R0429)",
    }
    assert {"woodbot", "mujoco"} <= {r["name"] for r in rows if not r["problem"]}


def test_a_package_that_cannot_be_read_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    bring(tmp_path / "site", "bad", "")
    (tmp_path / "site/bad-1.0.dist-info/entry_points.txt").write_bytes(b"\xff\xfe[")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    assert main(["show", "woodbot"]) == 0
    told = capsys.readouterr()
    assert told.err.startswith(f"rems: a package in {tmp_path / 'site'} cannot be read")
    assert told.err.count("\n") == 1
    assert told.out.startswith("woodbot: definition, built-in\n")


WOODBOT = """\
in command     unit   range        default
  wheel/left   rad/s  -7.3 to 7.3  0
  wheel/right  rad/s  -7.3 to 7.3  0
"""
USE = """\
[[robot]]
name = "my_robot"
definition = "woodbot"
driver = "kinematic"

lab.robot("my_robot", "woodbot", "kinematic")"""


def test_one_part_closely(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "show", "woodbot")
    assert text.startswith("woodbot: definition, built-in\n\nA two-wheeled robot")
    assert WOODBOT in text
    assert (
        "  mass                        kg     0.03 to 10     0.12      in all; weighed"
        in text
    )
    assert (
        "  reset(seed=None, initial=None)  Put it back to where the experiment starts"
        in text
    )
    assert "rems_net/robots/woodbot.py" in text.replace(os.sep, "/")
    assert text.endswith(USE)


def test_a_driver_shows_its_options(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "show", "kinematic")
    assert "  integrator  choice  default, euler, rk4  default  how rates" in text
    assert "  substeps    int     0 to 10000           0 " in text
    assert "command" not in re.findall(r"^(?:in|out) (\w+)", text, re.MULTILINE)


def test_a_picture_is_summed_up(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "show", "camera")
    assert "480 x 640 x 3" in text
    assert len(text.splitlines()) < 120


def test_a_name_of_two_kinds_shows_both(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "show", "csv")
    assert "csv: input, built-in" in text
    assert "csv: output, built-in" in text
    assert 'lab.input("my_input", "csv", options={"file": "..."})' in text
    assert "in robots: takes robot/*/* as it is" in text


def test_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    (plain,) = json.loads(said(capsys, "show", "woodbot", "--json"))
    left: dict[str, Any] = plain["ports"]["command"]["fields"]["wheel/left"]
    assert left == {
        "type": "float",
        "unit": "rad/s",
        "range": [-7.3, 7.3],
        "default": 0.0,
        "doc": "",
    }
    assert plain["parameters"]["track"]["default"] == 0.1126
    assert plain["use"]["python"] == 'lab.robot("my_robot", "woodbot", "kinematic")'


OWN = '''\
from rems_net import Definition, Experiment, In, Out, Process, Schema, verb
from rems_net.defdict import choice, length, velocity


class Cart(Definition):
    """Drives on a rail. It has no brakes."""

    needs = ("no_such_library",)
    command = In(Schema("command", {"speed": velocity(range=(-1, 1))}))
    state = Out(Schema("state", {"x": length(), "gear": choice("low", "high")}))

    @verb
    def grip(self, width: float, firmly: bool = False) -> None:
        """Close the hand."""


class Watch(Process):
    state = In(Cart.state)


lab = Experiment("own", duration="1 s")
lab.robot("cart", Cart, "kinematic")
lab.run()
'''


@pytest.fixture
def own(folder: Path) -> Path:
    (folder / "own.py").write_text(OWN)
    return folder


@pytest.mark.usefixtures("own")
def test_a_class_in_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    text = said(capsys, "show", "own.py:Cart")
    assert text.startswith(
        "own.py:Cart: definition, own.py\n"
        "It needs the library no_such_library, which is not installed.\n\n"
        "Drives on a rail. It has no brakes.\n"
    )
    assert "  gear     choice  low, high  low" in text
    assert "  grip(width: float, firmly: bool = False)  Close the hand." in text
    assert 'lab.robot("my_robot", "own.py:Cart", "kinematic")' in text
    watch = said(capsys, "show", "own.py:Watch")
    assert 'type = "own.py:Watch"\nstate = "robot/my_robot/state"' in watch


@pytest.mark.usefixtures("own")
def test_all_classes_in_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    words = " ".join(said(capsys, "show", "own.py").split())
    assert words == (
        "definitions own.py:Cart Drives on a rail. (no_such_library: not installed) "
        "own.py processes own.py:Watch (It has no docstring.) own.py"
    )


@pytest.mark.usefixtures("own")
@pytest.mark.parametrize(
    ("part", "sentence"),
    [
        (
            "wodbot",
            f"There is no part 'wodbot'; there is {names()}, or your own as "
            "'my_file.py:MyClass'. Did you mean 'woodbot'?",
        ),
        ("own.py:Crat", "own.py has no class 'Crat'. Did you mean 'Cart'?"),
        ("gone.py", "There is no file gone.py in FOLDER. Did you mean 'own.py'?"),
        (
            "pathlib:Path",
            "Path is no part; expected a subclass of Definition, Driver, Input, "
            "Process, Output, World.",
        ),
        ("no_such:Part", "Cannot import 'no_such': No module named 'no_such'."),
        (
            "plain.py",
            "plain.py defines no part: no class that inherits from Definition, Driver, "
            "Input, Process, Output, World.",
        ),
    ],
)
def test_what_is_no_part(
    own: Path, capsys: pytest.CaptureFixture[str], part: str, sentence: str
) -> None:
    (own / "plain.py").write_text("x = 1\n")
    assert complaint(capsys, "show", part) == sentence.replace("FOLDER", str(own))

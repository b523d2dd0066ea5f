"""`rems check`: everything that is checked before a run, and no run."""

import sys
from pathlib import Path

import pytest

from rems_net.cli import main
from rems_net.router import find
from tests.cli.conftest import LAB

GOOD = """\
lab can run: 3 agents, 1 s in 10 ticks of 0.1 s, as fast as possible.

input/keys  CsvInput
  out  value  wheel/left [rad/s], wheel/right [rad/s]

robot/model  Woodbot done by Kinematic
  in   command  wheel/left [rad/s], wheel/right [rad/s]  <- input/keys
  out  state    x [m], y [m], heading [rad]
  out  sensors  lidar/front [m], lidar/right [m], compass/x, compass/y, gyro/z
                [rad/s]

output/log  CsvOutput
  in  robots  every port that is there  <- robot/*/*
  in  worlds  every port that is there  <- world/*/*
"""
SCRIPT = """\
import sys

from rems_net import Experiment

lab = Experiment("first", dt="20 ms", pace=2)
lab.duration = float(sys.argv[1])
lab.robot("sim", "woodbot", "kinematic", every=5, since="1 s", host="crowd")
RUN
raise AssertionError("it went on")
"""


@pytest.fixture(autouse=True)
def nothing_is_opened(nothing_starts: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(find, "open_session")


def told(capsys: pytest.CaptureFixture[str], *args: str) -> str:
    assert main(args) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert not (Path.cwd() / "runs").exists()
    return "".join(f"{line.rstrip()}\n" for line in said.out.splitlines())


@pytest.mark.usefixtures("folder")
def test_an_experiment(capsys: pytest.CaptureFixture[str]) -> None:
    assert told(capsys, "check", "lab.toml") == GOOD


@pytest.mark.parametrize(
    "run",
    [
        "lab.run()",
        'if __name__ == "__main__":\n    lab.run("out")',
    ],
    ids=["plain", "guarded"],
)
def test_a_script_up_to_its_run(
    folder: Path, capsys: pytest.CaptureFixture[str], run: str
) -> None:
    (folder / "first.py").write_text(SCRIPT.replace("RUN", run))
    before = sys.argv[:], sys.path[:]
    said = told(capsys, "check", "first.py", "--", "2")
    assert said.startswith(
        "first can run: 1 agent, 2 s in 100 ticks of 0.02 s, 2 x real time.\n\n"
        "robot/sim  Woodbot done by Kinematic, every 5 ticks, from 1 s on, in host "
        "crowd\n  in   command  wheel/left [rad/s], wheel/right [rad/s]  <- any "
        "program\n"
    )
    assert (sys.argv, sys.path) == before
    assert sorted(p.name for p in folder.iterdir()) == [
        "first.py",
        "keys.csv",
        "lab.toml",
    ]


def test_the_pace_that_a_script_gives(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = SCRIPT.replace("RUN", 'lab.run(pace="fast")')
    (folder / "first.py").write_text(text)
    assert main(["check", "first.py", "--", "2"]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines()[0].endswith("0.02 s, as fast as possible.")
    assert "nothing commands robot/sim, and at pace" in said.err


def test_a_mistake(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The sentences are those of `rems run`: tests/cli/test_bad_input.py."""
    (folder / "lab.toml").write_text(LAB.replace("input/keys", "input/kyes"))
    assert main(["check", "lab.toml"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == (
        'rems: lab.toml, [[robot]] "model": robot/model.command is connected to '
        "'input/kyes', and there is no 'input/kyes'; there is input/keys, "
        "robot/model. Did you mean 'input/keys'? (R0422)\n"
    )

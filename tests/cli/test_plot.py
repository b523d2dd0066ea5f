"""`rems plot`: any recording as a picture."""

import os
from pathlib import Path

import pytest

from rems_net.cli import main
from tests import commands
from tests.commands import ROOT, Run

JOINT = """
from rems_net import Definition, Experiment, In, Out, Schema
from rems_net.defdict import angle, angular_velocity

class Arm(Definition):
    command = In(Schema("command", {"rate": angular_velocity()}))
    state = Out(Schema("state", {"joint": angle("deg")}))

    def derivative(self, state, command):
        return {"joint": "1 deg/s"}

lab = Experiment("arm", duration="1 s")
lab.robot("arm", Arm, "kinematic", initial={"joint": "30 deg"})
lab.output("log", "csv")
lab.run()
"""


@pytest.fixture(autouse=True)
def _matplotlib() -> None:
    pytest.importorskip("matplotlib", reason="matplotlib is not installed (an extra)")


def test_paths_and_fields(folder: Path, rems: Run) -> None:
    assert rems("run", "--direct", "lab.toml").returncode == 0
    done = rems("plot", "runs/lab")
    assert (done.returncode, done.stderr) == (0, "")
    assert rems("plot").stdout == done.stdout  # the newest run
    assert done.stdout == f"picture  {Path('runs/lab/plot.png')}\n"
    assert (folder / "runs/lab/plot.png").read_bytes().startswith(b"\x89PNG")
    done = rems("plot", "runs/lab", "sensors/lidar", "state/x", "--out", "a.svg")
    assert (done.returncode, done.stdout) == (0, "picture  a.svg\n")
    drawn = (folder / "a.svg").read_text(encoding="utf-8")
    for words in ("sensors/lidar/front", "sensors/lidar/right", "x [m]", "time [s]"):
        assert f"<!-- {words} -->" in drawn


def test_a_robot_without_a_path(folder: Path, rems: Run) -> None:
    (folder / "arm.py").write_text(JOINT, encoding="utf-8")
    assert rems("run", "--direct", "arm.py").returncode == 0
    assert rems("plot", "runs/arm", "--out", "arm.svg").returncode == 0
    drawn = (folder / "arm.svg").read_text(encoding="utf-8")
    assert "<!-- joint [deg] -->" in drawn
    assert "Where they drove" not in drawn


MISTAKES = [
    (
        ("runs/la",),
        f"rems: There is no folder {Path('runs/la')}; expected the folder of a run, "
        "such as runs/demo. Did you mean 'runs/lab'?",
    ),
    (
        ("runs/lab/model.csv",),
        f"rems: {Path('runs/lab/model.csv')} is a file; expected the folder of a run, "
        "such as runs/demo. Did you mean 'runs/lab'?",
    ),
    (
        ("lab.toml",),
        "rems: lab.toml is a file; expected the folder of a run, "
        "such as runs/demo. Did you mean 'runs/lab'?",
    ),
    (
        ("runs/lab", "state/heding"),
        "rems: no robot of this recording has 'state/heding'; there is "
        "command/wheel/left, command/wheel/right, state/x, state/y, state/heading, "
        "sensors/lidar/front, sensors/lidar/right, sensors/compass/x, "
        "sensors/compass/y, sensors/gyro/z. Did you mean 'state/heading'?",
    ),
    (
        ("runs/lab", "--out", "nowhere/a.png"),
        "rems: cannot write {here}{sep}nowhere{sep}a.png: No such file or directory.",
    ),
    (
        ("runs/lab", "--out", "a.docx"),
        "rems: cannot write {here}{sep}a.docx: Format 'docx' is not supported",
    ),
]


def test_mistakes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "--direct", "lab.toml"]) == 0
    capsys.readouterr()
    for words, sentence in MISTAKES:
        assert main(["plot", *words]) == 2, words
        printed = capsys.readouterr()
        assert printed.out == ""
        assert printed.err.startswith(sentence.format(here=folder, sep=os.sep))


def test_without_matplotlib(folder: Path, rems: Run) -> None:
    assert rems("run", "--direct", "lab.toml").returncode == 0
    # As if it were not installed: a module of that name that cannot be imported.
    broken = folder / "broken"
    broken.mkdir()
    (broken / "matplotlib.py").write_text("raise ImportError('not here')\n")
    path = os.pathsep.join([str(broken), str(ROOT)])
    done = commands.rems(folder, "plot", "runs/lab", PYTHONPATH=path)
    assert done.returncode == 2
    assert done.stderr == (
        "rems: The picture needs matplotlib, which cannot be imported (not here). "
        'Type: pip install "rems-net[plot]" (R0301)\n'
    )


@pytest.mark.parametrize("verb", ["plot", "compare", "info"])
def test_no_run_is_here(tmp_path: Path, verb: str) -> None:
    done = commands.inside(verb, folder=tmp_path)
    assert (done.returncode, done.stderr) == (
        2,
        "rems: there is no run in the folder runs here. Name one, such as `rems plot "
        "results/lab`, or go to the folder in which you typed `rems run`."
        " (R0908)\n",
    )

"""Identified parameters name their origin, and are refused for another definition."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import pytest

import rems_net
from rems_net import Create2, Definition, Experiment, In, Out, Schema, Settings
from rems_net.agents.experiment.file import load
from rems_net.cli import main
from rems_net.errors import ExperimentError
from rems_net.recordings.parameters.identified import read_identified
from rems_net.toml import loads
from rems_net.units import length, time, velocity
from tests.pages import blocks

LAB = """
[experiment]
name = "lab"
duration = "1 s"
[[robot]]
name = "model"
definition = "{}"
driver = "kinematic"
parameters = "sim.identified.toml"
"""


@pytest.fixture
def found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file of `rems identify`, from a run with another track and full speed."""
    monkeypatch.chdir(tmp_path)
    rows = [f"{i},{100 - 60 * (i % 3)},{100 - 45 * (i % 4)}" for i in range(1, 9)]
    header = "time [s],command/wheel/left [percent],command/wheel/right [percent]"
    Path("keys.csv").write_text("\n".join([header, *rows]))
    lab = Experiment("lab", dt=0.1)
    lab.input("keys", "csv", options={"file": "keys.csv"})
    lab.robot("sim", "woodbot", "kinematic", command="input/keys")
    lab.output("log", "csv")
    lab.run(direct=True, out="runs/lab")
    out = tmp_path / "sim.identified.toml"
    sets = ["--set", "track=0.1", "--set", "wheel_radius=0.02"]
    fit = ["--fit", "track,max_wheel_speed", "--out", str(out)]
    assert main(["identify", "runs/lab", "--robot", "sim", *sets, *fit]) == 0
    return out


def tracks(robot: Any) -> float:
    return float(robot.parameters.track)


def test_a_file_names_its_origin_and_a_lab_takes_it(found: Path) -> None:
    tables = loads(found.read_text(encoding="utf-8"))
    assert tables["robot"] == "sim"
    assert tables["definition"] == "Woodbot"
    assert tables["versions"]["rems_net"] == rems_net.__version__
    ((name, digest),) = tables["recordings"].items()
    assert hashlib.sha256(Path(name).read_bytes()).hexdigest() == digest
    # Those that were found, and those that the recording was made with.
    assert tables["parameters"]["wheel_radius"] == 0.02
    Path("lab.toml").write_text(LAB.format("woodbot"))
    model = load(Path("lab.toml")).check()["robot/model"]
    assert tracks(model) == pytest.approx(0.1126, rel=1e-3)


def test_an_estimator_takes_it(found: Path) -> None:
    lab = Experiment("lab")
    lab.robot("sim", "create2", "kinematic")
    words = {"command": "robot/sim/command", "sensors": "robot/sim/sensors"}
    options = {"definition": "woodbot", "parameters": found.name}
    lab.process("ekf", "ekf", options=options, **words)
    estimator: Any = lab.build()["process/ekf"]
    estimator.prepare()
    assert tracks(estimator.model) == pytest.approx(0.1126, rel=1e-3)
    options["definition"] = "create2"
    lab.process("other", "ekf", options=options, **words)
    with pytest.raises(ExperimentError, match="identified for Woodbot, and this robot"):
        lab.build()


def test_the_page_is_true(found: Path) -> None:
    page = Path(__file__).parents[2] / "docs" / "identification.md"
    (text,) = blocks(page, "toml")
    found.rename("mujoco.identified.toml")
    Path("lab.toml").write_text(text)
    assert main(["check", "lab.toml"]) == 0


def test_another_definition_is_refused_in_one_sentence(found: Path) -> None:
    Path("lab.toml").write_text(LAB.format("create2"))
    with pytest.raises(ExperimentError) as refused:
        load(Path("lab.toml"))
    assert str(refused.value) == (
        'lab.toml, [[robot]] "model": sim.identified.toml has parameters that were '
        "identified for Woodbot, and this robot is a Create2; identify this robot: "
        "rems identify --robot sim --out sim.identified.toml (R0880)"
    )


class Woodbot(Definition):
    """A definition of the same name, with other parameters."""

    parameters = Settings(track=length(default=0.1126), lag=time(default=0.1))
    command = In(Schema("c", {"speed": velocity()}))
    state = Out(Schema("s", {"x": length()}))


def test_a_definition_that_has_changed_is_refused(found: Path) -> None:
    lab = Experiment("lab")
    with pytest.raises(ExperimentError, match=r"another version of Woodbot, before"):
        lab.robot("model", Woodbot, "kinematic", parameters=found.name)
    assert not lab.plans


def test_a_damaged_file_or_none(found: Path) -> None:
    lab = Experiment("lab")
    for text in ("track = 0.1", "[[", 'parameters = "x"', f"a = {'[' * 50_000}"):
        found.write_text(text)
        with pytest.raises(ExperimentError, match="is not what `rems identify` writes"):
            lab.robot("model", Create2, "kinematic", parameters=found)
    found.unlink()
    with pytest.raises(ExperimentError, match=r"There is no file .*R0880"):
        read_identified(found)

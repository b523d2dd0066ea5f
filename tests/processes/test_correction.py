"""Weights in a file: a robot that is corrected by them, or is left as it was."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.experiment.show import Show
from rems_net.drivers.kinematic.correction import Weights
from rems_net.errors import AgentError, ExperimentError, uncoded
from rems_net.events import Event, listening
from tests.processes.beside import FOUND, POSE, error, late, learned, save

AGENTS = Path(__file__).parents[1] / "agents"


def corrected(path: Path, definition: str = "woodbot", **more: Any) -> Experiment:
    made = Experiment("one", dt=more.pop("dt", 0.1), duration=1.0, folder=AGENTS)
    made.input("wheels", "parts.py:Wheels")
    given: dict[str, Any] = {"parameters": FOUND, **more}
    made.robot("alone", definition, "kinematic", command="input/wheels", **given)
    given["options"] = {"correction": str(path)}
    made.robot("r", definition, "kinematic", command="input/wheels", **given)
    return made


@pytest.fixture(scope="module")
def weights() -> Weights:
    return replace(learned(late(1, 12.0), FOUND), helps=True)


def states(made: Experiment) -> list[dict[str, Any]]:
    with made.engine() as engine:
        engine.run()
        return [
            {path: engine[f"robot/{name}"].state[path] for path in POSE}
            for name in ("alone", "r")
        ]


def test_a_closed_gate_leaves_the_robot_as_it_was(
    tmp_path: Path, weights: Weights
) -> None:
    events: list[Event] = []
    with listening(events.append):
        path = save(tmp_path, replace(weights, helps=False))
        alone, same = states(corrected(path))
    assert alone == same
    assert "do not help" in events[0].text
    alone, other = states(corrected(save(tmp_path, weights)))
    assert alone != other


def test_weights_that_run_away_leave_the_robot_as_it_was(
    tmp_path: Path, weights: Weights
) -> None:
    huge = replace(weights, weights=[1e9] * len(weights.weights))
    events: list[Event] = []
    with listening(events.append):
        alone, same = states(corrected(save(tmp_path, huge)))
    assert alone == same
    assert "robot/r: its correction has run away" in events[0].text


def test_a_correction_is_learned_beside_motors_that_lag(tmp_path: Path) -> None:
    """The definition knows the lag and the delay, so the network learns less."""
    known = {**FOUND, "actuation/lag": "90 ms", "actuation/delay": "60 ms"}
    other = late(11, 12.0)
    path = save(tmp_path, learned(late(1, 30.0), known))
    alone = error(other, known, None, 1.0)
    assert alone < 0.4 * error(other, FOUND, None, 1.0)
    assert error(other, known, path, 1.0) <= 1.05 * alone


def test_a_file_reads_back_to_the_same_bits(tmp_path: Path, weights: Weights) -> None:
    assert Weights.read(save(tmp_path, weights)) == weights


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"weights": [float("nan")] * 58}, ".*has no weights of a residual, or some"),
        ({"weights": [0.0]}, ".*has no weights of a residual, or some"),
        ({"commands": ["x", "y"]}, ".*has weights for a Woodbot with the command x, y"),
        ({"definition": "Cart"}, ".*has weights for a Cart with the command wheel/l"),
    ],
)
def test_a_wrong_file_is_refused(
    tmp_path: Path, weights: Weights, change: dict[str, Any], sentence: str
) -> None:
    path = save(tmp_path, weights)
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(ExperimentError) as caught:
        corrected(path).check()
    assert re.match(f"robot 'r': {sentence}", uncoded(caught.value))


def test_weights_of_another_robot_are_refused(tmp_path: Path, weights: Weights) -> None:
    path = save(tmp_path, weights)
    with pytest.raises(ExperimentError, match="this robot is a Create2"):
        corrected(path, "create2").check()
    with pytest.raises(ExperimentError, match="with other parameters or another"):
        corrected(path, parameters={**FOUND, "track": "90 mm"}).check()
    with pytest.raises(ExperimentError, match="with other parameters or another"):
        corrected(path, parameters={**FOUND, "actuation/lag": "90 ms"}).check()
    with pytest.raises(AgentError, match=r"at steps of 0\.1 s, and this one has 0\.05"):
        corrected(path, dt=0.05).run(tmp_path / "out", direct=True, show=Show())
    path.write_text("[" * 100_000)
    with pytest.raises(ExperimentError, match="has no weights of a residual"):
        corrected(path).check()
    path.unlink()
    with pytest.raises(ExperimentError, match="cannot be read: No such file"):
        corrected(path).check()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({}, "process/learner needs the definition of the robot that it reads; write"),
        ({"definition": "youbot_arm"}, "the state of a youbot_arm has no 'x'; a resid"),
        ({"definition": "woodbot", "parameters": "track"}, "parameters = 'track' cann"),
        ({"definition": "woodbot", "parameters": "a.toml"}, "There is no file a.toml"),
    ],
)
def test_what_cannot_be_learned_is_refused(
    options: dict[str, str], sentence: str
) -> None:
    made = Experiment("one", dt=0.1, duration=1.0)
    made.robot("r", "woodbot", "kinematic")
    given = {"command": "robot/r/command", "state": "robot/r/state"}
    made.process("learner", "residual", options=options, **given)
    with pytest.raises(ExperimentError) as caught:
        made.check()
    assert uncoded(caught.value).startswith(f"process 'learner': {sentence}")

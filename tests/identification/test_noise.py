"""Noise of sensors from a recording: planted noise is found, faults are named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import rems_net
from rems_net import DefDict, Definition, Experiment, Woodbot
from rems_net.bodies.noise import Noise
from rems_net.errors import ExperimentError
from rems_net.identification.noise import SensorNoise
from rems_net.identification.result import Identified

#: kept within the arena: a wall out of reach shows nothing
TURNS = ((3, 5), (5, 2), (-2, -4), (4, 4), (-5, -5), (3, -3))


def recorded(
    folder: Path, seconds: float, definition: type[Definition] = Woodbot
) -> Identified:
    lab = Experiment("lab", dt="50 ms", duration=seconds, seed=5)
    noisy = {"noise": True}
    lab.robot("sim", definition, "kinematic", options=noisy)
    with lab.engine(folder) as engine:
        for left, right in TURNS * 100:
            if engine.t >= seconds - 0.6:
                break
            engine.put("robot/sim/command", {"wheel": {"left": left, "right": right}})
            engine.step(10)
    recording = rems_net.read(folder)
    return rems_net.identify(recording, "sim", definition=Woodbot, fit=["track"])


def noise(*words: Any) -> dict[str, SensorNoise]:
    return {one.name: one for one in recorded(*words).noise}


def test_planted_noise_is_found(tmp_path: Path) -> None:
    """What `Woodbot.noise` states: 4 % of a distance, 0.03, and 0.0035 rad/s."""
    found = noise(tmp_path, 40.0)
    right = found["lidar/right"]
    assert right.rows > 300
    assert right.relative == pytest.approx(0.04, rel=0.1)
    assert right.absolute == 0.0
    assert found["compass/x"].absolute == pytest.approx(0.03, rel=0.1)
    gyro = found["gyro/z"]
    assert gyro.absolute == pytest.approx(0.0035, rel=0.1)
    assert abs(gyro.bias) <= 0.05
    assert str(right).startswith("lidar/right: noise 4.0 % of the value")


def test_few_rows_are_too_few_to_say(tmp_path: Path) -> None:
    found = noise(tmp_path, 1.4)
    assert "rows are too few for its noise." in str(found["lidar/right"])


class Turned(Woodbot):
    """A Woodbot whose compass is mounted upside down."""

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        read = super().measure(state, command)
        return read | {"compass/x": -read["compass/x"]}


def test_a_turned_sign_is_named(tmp_path: Path) -> None:
    found = noise(tmp_path, 10.0, Turned)
    assert str(found["compass/x"]).startswith("compass/x: its sign is turned round")
    assert not found["gyro/z"].fault


class Loud(Woodbot):
    """A Woodbot with a cheap lidar on its right, and a worn gyroscope."""

    def noise(self) -> dict[str, Noise]:
        return {"lidar/right": Noise(relative=0.08), "gyro/z": Noise(absolute=0.02)}


def test_a_robot_with_an_identified_file_has_its_noise(tmp_path: Path) -> None:
    file = tmp_path / "sim.identified.toml"
    recorded(tmp_path / "run", 20.0, Loud).write(file)
    lab = Experiment("lab", dt="50 ms")
    words: dict[str, Any] = {"parameters": file, "options": {"noise": True}}
    lab.robot("model", "woodbot", "kinematic", **words)
    options = {"definition": "woodbot", "parameters": str(file)}
    ports = {"command": "robot/model/command", "sensors": "robot/model/sensors"}
    lab.process("ekf", "ekf", options=options, **ports)
    agents: Any = lab.build()
    model, ekf = agents["robot/model"], agents["process/ekf"]
    ekf.prepare()
    for found in (model.noises(), ekf.model.noises()):
        assert found["lidar/right"].relative == pytest.approx(0.08, rel=0.1)
        assert found["gyro/z"].absolute == pytest.approx(0.02, rel=0.1)


def test_noise_that_cannot_be_read_is_named() -> None:
    options = {"noise": True, "noises": "gyro/z = { loud = 1 }"}
    lab = Experiment("lab")
    lab.robot("model", "woodbot", "kinematic", options=options)
    with pytest.raises(
        ExperimentError, match=r"'gyro/z' = {'loud': 1}; expected such as"
    ):
        lab.check()

"""A Create 2 in a whole run: real processes, a real clock, a real port."""

import csv
from pathlib import Path

import pytest

from rems_net import Experiment
from rems_net.agents.protocol.plan import HERE
from tests.agents.runs import Told
from tests.drivers.hardware.create2.scene import driven, emulated, wheels

KEYS = """\
time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]
1.5,5.0,4.0
"""


def lab(folder: Path, port: str) -> Experiment:
    (folder / "keys.csv").write_text(KEYS)
    made = Experiment("create2", dt=0.05, duration=1.5, pace=1, folder=folder)
    made.record = False
    made.input("keys", "csv", options={"file": "keys.csv"}, host=HERE)
    made.robot("model", "create2", "kinematic", command="input/keys", host=HERE)
    made.robot(
        "real", "create2", "create2", command="input/keys", options={"port": port}
    )
    made.output("log", "csv", host=HERE)
    return made


def test_beside_its_model(tmp_path: Path) -> None:
    with emulated(tmp_path) as emulator:
        told = Told()
        lab(tmp_path, emulator.where).run(tmp_path / "out", show=told)
        assert wheels(emulator) == (0, 0)
        assert {*driven(emulator)} == {(0, 0), (180, 144)}
    assert any(" exchanges at 50 Hz" in line for line in told.lines)
    last = {}
    for name in ("model", "real"):
        with (tmp_path / "out" / f"{name}.csv").open(encoding="utf-8") as file:
            last[name] = float([*csv.DictReader(file)][-1]["state/x [m]"])
    assert last["model"] == pytest.approx(1.5 * 0.162, abs=0.02)
    # It began when it was told, and not before: less far than its model.
    assert 0.05 < last["real"] < last["model"] + 0.02

"""The class's own recordings, replayed through the whole chain: file to file.

CSV input agent, fabric, robot agent, CSV output agent: real processes.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from tests.robots.lab import FOLDER, models, recording
from tests.robots.webots import RECORDING, distance_from_webots

CLASS = {"track": "0.1 m", "max_wheel_speed": "6.8 rad/s", "wheel_radius": "20 mm"}


def replay(name: str, driver: str, out: Path, dt: str, **robot: Any) -> Path:
    """Play a recording's commands to a Woodbot; return the CSV it leaves."""
    recording(name)  # skips where it is not there
    lab = Experiment("replay", dt=dt, folder=FOLDER)
    lab.input("keys", "csv", options={"file": name})
    lab.robot("bot", "woodbot", driver, command="input/keys", **robot)
    lab.output("log", "csv")
    lab.run(out)
    return out / "bot.csv"


def columns(path: Path, *names: str) -> list[tuple[float, ...]]:
    with path.open(newline="", encoding="utf-8") as file:
        return [tuple(float(row[n]) for n in names) for row in csv.DictReader(file)]


@pytest.mark.parametrize("name", models())
def test_the_chain_reproduces_the_class_model(name: str, tmp_path: Path) -> None:
    rows = recording(name)
    made = replay(name, "kinematic", tmp_path, "0.1 s", parameters=CLASS)
    ours = columns(
        made, "time [s]", "state/x [m]", "state/y [m]", "state/heading [rad]"
    )
    assert len(ours) == len(rows) == 101
    for (t, x, y, heading), row in zip(ours, rows, strict=True):
        assert t == pytest.approx(row["timestamp"], abs=1e-9)
        assert x == pytest.approx(row["state.x"], abs=1e-12)
        assert y == pytest.approx(row["state.y"], abs=1e-12)
        assert heading == pytest.approx(row["state.th_z"], abs=1e-12)


def test_what_the_chain_wrote_can_be_played_again(tmp_path: Path) -> None:
    name = models()[-1]
    first = replay(name, "kinematic", tmp_path / "a", "0.1 s", parameters=CLASS)
    lab = Experiment("again", dt="0.1 s", folder=first.parent)
    lab.input("keys", "csv", options={"file": first.name})
    lab.robot("bot", "woodbot", "kinematic", command="input/keys", parameters=CLASS)
    lab.output("log", "csv")
    lab.run(tmp_path / "b")
    assert (tmp_path / "b/bot.csv").read_bytes() == first.read_bytes()


@pytest.mark.parametrize("driver", ["mujoco", "pybullet"])
def test_physics_is_closer_to_webots_than_the_class_model(
    driver: str, tmp_path: Path
) -> None:
    pytest.importorskip(driver, reason=f"{driver} is not installed (an extra)")
    rows = recording(RECORDING)
    # Webots' rows are at multiples of its own step, 3 ms.
    made = replay(RECORDING, driver, tmp_path, "3 ms")
    ours = {
        round(t, 6): pose
        for t, *pose in columns(
            made, "time [s]", "state/x [m]", "state/y [m]", "state/heading [rad]"
        )
    }
    x, y, heading = zip(*(ours[round(r["timestamp"], 6)] for r in rows), strict=True)
    distance = distance_from_webots(x, y, heading, rows)
    print(f"{driver}: {1000 * distance:.1f} mm from Webots (RMS over {len(rows)} rows)")
    assert distance < 0.029  # the class's own model, with its constants

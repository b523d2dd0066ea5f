"""A run with a camera and a ghost is done again without the camera and its pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net import Experiment
from rems_net.agents.experiment.again.compared import compare
from rems_net.agents.experiment.again.rebuilt import rebuild
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.recordings.mcap.reader import McapFile
from tests.drivers.physics.eyes import why_not
from tests.drivers.worlds.ghosts import Drive, Near, Tall

pytest.importorskip("apriltag")


def test_poses_as_they_came_are_played_to_the_byte(tmp_path: Path) -> None:
    """A camera finds a robot in one world, which is a ghost in another."""
    if why := why_not(Mujoco):
        pytest.skip(why)
    folder = Path(__file__).parents[1] / "drivers" / "worlds"
    made = Experiment("again", dt="50 ms", duration="1 s", folder=folder)
    made.input("drive", Drive, options={"speed": 4.0})
    made.world("real", options={"size": [2.0, 2.0]})
    marker, start = {"id": 3, "size": "40 mm"}, {"x": 0.3, "heading": "180 deg"}
    bot: dict[str, Any] = {"initial": start, "marker": marker}
    made.robot("bot", "woodbot", "mujoco", world="real", command="input/drive", **bot)
    place = {"place": {"x": 0.2, "z": 0.6}}
    made.robot("cam", "camera", "mujoco", world="real", parameters=place)
    options = {"robots": "bot"}
    made.process("eyes", "localise", camera="robot/cam/sensors", options=options)
    ghost = {"name": "bot", "definition": Tall, "follows": "process/eyes/bot"}
    made.world("twin", options={"size": [2.0, 2.0]}, ghosts=[ghost])
    made.process("near", Near, seen="robot/a/sensors")
    made.robot("a", Tall, "kinematic", world="twin", command="process/near")
    made.output("log", "mcap", options={"pictures": False})
    run = made.run(tmp_path / "out", direct=True)

    true, ghosts = run["bot"], run["world.twin"]
    off = np.array(ghosts["bot/pose/x"][2:]) - np.array(true["state/x"][:-2])
    assert np.abs(off).max() < 0.01  # a pose is one tick old, at 0.08 m/s
    assert 0.1 < run["a"]["sensors/lidar/front"][-1] < 0.25  # it sees the ghost

    path = tmp_path / "out" / "run.mcap"
    assert path.stat().st_size < 500_000  # a picture has 900,000
    assert "robot/cam/sensors" not in McapFile(path).schemas
    again = rebuild(path, folder)
    assert {"robot/cam", "process/eyes"} == {*again.played}
    compared = compare(again)
    assert compared.differ == 0, compared.by_agent()
    assert compared.messages > 100
    for key in ("robot/bot", "robot/a", "world/twin", "process/near"):
        assert compared.agents[key] == "recomputed"

"""A robot that drives: its poses, and an estimate that bridges seconds without one."""

from __future__ import annotations

from math import sin
from typing import Any

import numpy as np
import pytest

from rems_net import Experiment, Input, Out, Tick, Woodbot
from rems_net.bodies.body import Marker
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.eyes.finder import Finder, Target
from tests.drivers.physics.eyes import why_not
from tests.eyes.paper import SCALE, SIZE, above, pasted

pytest.importorskip("apriltag")


class Fast(Input):
    """Nearly full speed, 0.14 m/s, in a slight curve."""

    value = Out(Woodbot.command)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"wheel/left": 6.9 - 0.35 * sin(1.5 * tick.t), "wheel/right": 7.3}


def test_a_camera_and_a_filter_follow_a_robot_in_mujoco() -> None:
    """20 pictures a second by one camera, and one in two seconds by the other.

    Measured: poses 0.06 mm, the filter 0.09 mm, and 4.1 mm after 2 s without a picture:
    it does not know how long wheels take to turn.
    """
    if why := why_not(Mujoco):
        pytest.skip(why)
    made = Experiment("moving", dt=0.05)
    made.world("place", options={"size": [2.0, 2.0]})
    made.input("fast", Fast)
    common: dict[str, Any] = {"driver": "mujoco", "world": "place"}
    start = {"x": -0.35, "y": -0.1, "heading": 0.2}
    mark = {"id": 3, "size": "40 mm"}
    drives: dict[str, Any] = {"command": "input/fast", "initial": start, "marker": mark}
    made.robot("bot", "woodbot", **drives, **common)
    for name, every in (("often", 1), ("seldom", 40)):
        about = {"place": {"z": 0.9}, "every": every}
        made.robot(name, "camera", parameters=about, **common)
        camera, seen = f"robot/{name}/sensors", f"process/by_{name}/bot"
        options = {"robots": "bot"}
        made.process(f"by_{name}", "localise", camera=camera, options=options)
        made.process(
            f"ekf_{name}",
            "ekf",
            command="robot/bot/command",
            pose=seen,
            options={"definition": "woodbot"},
        )
    true: dict[int, Any] = {}
    off: list[list[float]] = []
    with made.engine() as engine:
        for n in range(1, 84):
            engine.step()
            true[n] = engine["robot/bot"].state.to_array()[:2]
            pose = engine["process/by_often"].bot
            ekfs = [engine[f"process/ekf_{name}"].state for name in ("often", "seldom")]
            aways = [np.array([pose.x, pose.y]) - true[max(1, pose.tick)]]
            aways += [one.to_array()[:2] - true[n] for one in ekfs]
            off.append([float(np.hypot(*away)) for away in aways])
    speed = np.hypot(*(true[83] - true[23])) / 3.0
    assert 0.13 < speed < 0.15
    pose, often, seldom = np.array(off[3:]).max(axis=0)
    assert pose < 0.3e-3
    assert often < 0.3e-3
    assert 0.5e-3 < seldom < 8e-3


def test_a_smeared_marker_is_found_in_the_middle_of_its_way() -> None:
    """While a picture is exposed for 24 ms, a robot at 0.14 m/s goes four pixels."""
    exposed = [pasted([(3, (step + 0.25) / SCALE, 0.0)]) for step in range(5)]
    grey = np.mean(exposed, axis=0).astype(np.uint8)
    finder = Finder(above(), {3: Target("bot", Marker("tag36h11", 3, SIZE), 0.0)})
    (sharp,), _ = finder.look(exposed[2])
    (one,), doubts = finder.look(grey)
    assert doubts == []
    assert np.hypot(*(one.pose - sharp.pose)[:2]) < 0.3e-3

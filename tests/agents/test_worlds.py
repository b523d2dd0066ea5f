"""Worlds in a run: one process for all that are in it, things at keys, equal bytes."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.file import load
from rems_net.agents.protocol.plan import HERE
from rems_net.client import join
from rems_net.errors import AgentError
from rems_net.recordings.manifest import read_manifest
from tests.agents.runs import Told, digest, until
from tests.drivers.physics.test_physics import needs

#: drives, and waits until a ball has moved
PUSH = """
from rems_net import In, Input, Out, Process, Schema
from rems_net.agents.world import OBJECT
from rems_net.defdict import angular_velocity

WHEELS = Schema("w", {"wheel": {s: angular_velocity() for s in ("left", "right")}})

class Ahead(Input):
    value = Out(WHEELS)

    def read(self, tick):
        if tick.t < 0.7:
            return {"wheel/left": 5.0, "wheel/right": 5.0}

class Wait(Process):
    ball = In(OBJECT, source="world/arena/ball")
    value = Out(WHEELS)

    def step(self, tick):
        moved = self.ball.pose.x > 0.101
        self.value = {"wheel/left": 3.0 * moved, "wheel/right": 3.0 * moved}
"""
Change = Callable[[Experiment], None]


def lab(folder: Path, driver: str = "mujoco", **more: Any) -> Experiment:
    """One robot goes at a ball; another waits until that has moved."""
    (folder / "push.py").write_text(PUSH)
    made = Experiment("push", dt=0.05, duration=1.5, folder=folder, **more)
    made.input("ahead", "push.py:Ahead")
    made.process("wait", "push.py:Wait")
    places = {"pusher": {}, "waiter": {"y": 0.25}}
    for name, place in places.items():
        command = "input/ahead" if name == "pusher" else "process/wait"
        made.robot(
            name, "woodbot", driver, command=command, world="arena", initial=place
        )
    ball = {"name": "ball", "radius": 0.02, "x": 0.1, "mass": 0.01}
    made.world("arena", options={"radius": "0.6 m", "balls": [ball]})
    made.output("log", "csv")
    return made


def backwards(made: Experiment) -> None:
    made.plans = dict(reversed(made.plans.items()))


@needs("mujoco")
def test_things_are_heard_and_runs_are_the_same(tmp_path: Path) -> None:
    first = lab(tmp_path)
    result = first.run(tmp_path / "a", show=Told())
    waiter, pusher = result["waiter"], result["pusher"]
    x = list(waiter["state/x"])
    assert abs(x[5]) < 1e-3  # it waits
    assert x[-1] > 0.02  # and goes when the ball has moved
    assert pusher["state/x"][-1] > 0.05
    # What it was told is too old at last, and it stands.
    assert list(pusher["command/wheel/left"])[::29] == [5.0, 0.0]
    assert abs(pusher["state/x"][-1] - pusher["state/x"][-5]) < 1e-3
    ball = result["world.arena"]
    assert list(ball)[:3] == ["time", "ball/pose/x", "ball/pose/y"]
    assert len(ball) == 7
    assert float(ball["ball/pose/x"].max()) > 0.12
    # What is waited for at one tick is told for the next: these were of one moment.
    went = int((ball["ball/pose/x"].value > 0.101).argmax())
    assert list(waiter["command/wheel/left"] > 0).index(True) == went + 1
    assert [pair.a for pair in result.compare()] == ["pusher"]
    told = read_manifest(tmp_path / "a")
    assert told is not None
    assert told.files == [
        "pusher.csv",
        "run.mcap",
        "waiter.csv",
        "world.arena.csv",
    ]
    again = lab(tmp_path)
    backwards(again)
    again.plans["input/ahead"].host = again.plans["process/wait"].host = "both"
    again.run(tmp_path / "b", show=Told())
    assert digest(tmp_path / "a") == digest(tmp_path / "b")


def test_one_process_for_all_that_are_in_it(tmp_path: Path) -> None:
    """And what they are asked for, from outside."""
    found: dict[str, Any] = {}

    def look(clock: Clock) -> None:
        with join(at=told.endpoint) as fabric:
            until(lambda: clock.tick.n > 5)
            found["agents"] = {row["agent"]: row["host"] for row in fabric.agents()}
            found["pose"] = fabric.get("world/arena/ball/pose")
            found["x"] = fabric.get("world/arena/*/pose/x")
            found["wheel"] = fabric.get("robot/pusher/command/wheel")
            found["reset"] = fabric.call("world/arena", "reset", (), {})

    told = Told(look)
    made = lab(tmp_path, "kinematic", pace=1.0, record=False)
    for key in ("input/ahead", "process/wait", "output/log"):
        made.plans[key].host = HERE
    made.run(tmp_path / "a", show=told)
    hosts = found["agents"]
    assert {hosts[f"robot/{n}"] for n in ("pusher", "waiter")} == {hosts["world/arena"]}
    (pose,) = found["pose"].values()
    assert pose["values"]["pose/x"] == {"value": 0.1, "unit": "m"}
    assert list(pose["values"]) == [
        f"pose/{name}" for name in ("x", "y", "z", "heading", "pitch", "roll")
    ]
    assert list(found["x"]) == ["rems/world/arena/ball/pose/x"]
    (wheel,) = found["wheel"].values()
    assert wheel["values"]["wheel/left"]["value"] == 5.0


def test_a_world_is_described_in_a_file_or_in_python(tmp_path: Path) -> None:
    (tmp_path / "lab.toml").write_text(
        """
[experiment]
duration = "1 s"
[[world]]
name = "arena"
options.radius = "60 cm"
options.balls = [{ name = "ball", radius = 0.02, x = "10 cm", mass = "10 g" }]
[[robot]]
name = "a"
definition = "woodbot"
driver = "kinematic"
world = "arena"
"""
    )
    read = load(tmp_path / "lab.toml").check()["world/arena"]
    written = lab(tmp_path, "kinematic").check()["world/arena"]
    assert vars(read)["scene"] == vars(written)["scene"]


#: cannot sense from the third tick on, if it is called b
BLIND = """
from rems_net.robots.woodbot import Woodbot

class Blind(Woodbot):
    def sense(self):
        if self.name == "b" and self.tick.n == 3:
            raise RuntimeError("too dark")
        super().sense()
"""


def test_who_fails_in_a_world_is_named(tmp_path: Path) -> None:
    (tmp_path / "blind.py").write_text(BLIND)
    made = Experiment("dark", dt=0.05, duration=0.5, folder=tmp_path)
    made.world("cave", options={"size": [2.0, 1.0]})
    for x, name in enumerate("abc"):
        place = {"x": 0.5 * x - 0.5}
        made.robot(name, "blind.py:Blind", "kinematic", world="cave", initial=place)
    with pytest.raises(AgentError, match=r"robot/b: RuntimeError: too dark"):
        made.run(tmp_path / "out", show=Told())

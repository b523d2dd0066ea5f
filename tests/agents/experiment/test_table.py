"""One way to write a plan: in a file, for a host, for another machine, in run.json."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.experiment.again.replayed import nested
from rems_net.agents.experiment.file import load
from rems_net.agents.experiment.folder import own_folder
from rems_net.agents.experiment.hosting.hosts import Hosts
from rems_net.agents.experiment.placement.offers import make_offers
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.placement import read_offer
from rems_net.agents.protocol.plan import read_plans
from rems_net.errors import WireError
from rems_net.toml import loads

FOLLOW = """
from rems_net import In, Out, Process, Settings
from rems_net.defdict import array, number
from rems_net.robots.woodbot import Woodbot


class Follow(Process):
    options = Settings(gain=number(), gains=array(2, default=(1, 1)))
    target = In(Woodbot.state)
    value = Out(Woodbot.state)

    def step(self, tick):
        self.value = self.target
"""
#: what each agent is; settings stand as they are checked, in their own units
LAB = """
[[input]]
name = "keys"
type = "rems_net.inputs.csv:CsvInput"
options.file = "keys.csv"

[[robot]]
name = "bot"
definition = "rems_net.robots.woodbot:Woodbot"
driver = "rems_net.drivers.kinematic.kinematic:Kinematic"
command = "input/keys"
parameters = { track = 0.12 }
initial = { x = 0.2 }
every = 2
since = 0.3
machine = "b"
restart = 1

[[robot]]
name = "arena"
definition = "rems_net.robots.woodbot:Woodbot"
driver = "rems_net.drivers.kinematic.kinematic:Kinematic"
world = "hall"
every = 3

[[world]]
name = "hall"
options.radius = 2.0

[[process]]
name = "follow"
type = "follow.py:Follow"
target = "robot/bot/state"
options.gain = 2.5
options.gains = [0.5, 1.5]
host = "brain"

[[output]]
name = "log"
type = "rems_net.outputs.csv:CsvOutput"
"""
KEYS = "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]\n1,1.0,2.0\n"


def placed(tables: dict[str, list[dict[str, Any]]]) -> dict[str, list[dict[str, Any]]]:
    """Leave out where agents live, which does not change what they make; sort them."""
    where = ("host", "machine")
    return {
        kind: sorted(
            ({k: v for k, v in one.items() if k not in where} for one in some),
            key=lambda one: str(one["name"]),
        )
        for kind, some in tables.items()
    }


SEVERAL = """
[[input]]
name = "base"
type = "sharers.py:Base"

[[process]]
name = "arm"
type = "sharers.py:Above"
robot = "robot/kuka/state"

[[robot]]
name = "kuka"
definition = "youbot"
driver = "kinematic"
command = ["input/base", "process/arm"]

[[robot]]
name = "sled"
definition = "callers.py:Sled"
driver = "kinematic"

[[process]]
name = "referee"
type = "callers.py:Referee"
sled = "robot/sled/state"
"""


def test_several_writers_and_callers_of_a_robot_are_written_and_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On their way to another machine; `run.json` has what a file has."""
    monkeypatch.setattr(sys, "argv", ["lab"])
    parts = Path(__file__).parents[2] / "engine"
    for name in ("sharers.py", "callers.py"):
        (tmp_path / name).write_bytes((parts / name).read_bytes())
    (tmp_path / "lab.toml").write_text(SEVERAL)
    lab = load(tmp_path / "lab.toml")
    agents = lab.check()
    robots = {"robot/kuka": "b", "robot/sled": "b"}
    offer = read_offer(make_offers(lab, agents, robots).by_machine["b"].to_wire())
    kuka, sled = read_plans(offer.agents, lab.folder, lab.dt)
    assert [*kuka.reads("command")] == ["input/base", "process/arm"]
    assert kuka.sources == lab.plans["robot/kuka"].sources
    assert sled.sources == {
        "@calls/process/referee/verbs": "process/referee/verbs",
    }
    with own_folder(lab, tmp_path / "out", agents, Show()) as out:
        kept = json.loads((out / "run.json").read_text())["agents"]["robot"]
    assert kept[0]["command"] == ["input/base", "process/arm"]
    assert set(kept[1]) == {"name", "definition", "driver"}
    for wrong in ({"@calls": ["x"]}, {"@calls": 3}, {"command": [3]}):
        table = {**offer.agents["robot"][0], **wrong}
        with pytest.raises(WireError):
            read_offer(offer._replace(agents={"robot": [table]}).to_wire())


def test_a_plan_is_written_in_one_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["lab"])
    (tmp_path / "follow.py").write_text(FOLLOW)
    (tmp_path / "keys.csv").write_text(KEYS)
    (tmp_path / "lab.toml").write_text(LAB)
    file = loads(LAB)
    lab = load(tmp_path / "lab.toml")
    agents, hosts = lab.check(), lab.by_host()

    def short(tables: Any) -> Any:
        """With the name of a file in place of its path."""
        folder = json.dumps(str(lab.folder / "x"))[1:-2]
        return json.loads(json.dumps(tables).replace(folder, ""))

    starting = Hosts(hosts, agents, Show(), lab.dt)
    wire: dict[str, list[Any]] = {kind: [] for kind in file}
    for host, plans in hosts.items():
        words = starting.words(host)
        for kind, some in words["agents"].items():
            wire[kind] += some
        read = read_plans(words["agents"], lab.folder, lab.dt)
        for plan in read:
            mine = next(p for p in plans if p.key == plan.key)
            assert (plan.host, plan.since, plan.every, plan.sources) == (
                *(mine.host, mine.since, mine.every, mine.sources),
            )
            again, first = plan.build(), agents[plan.key]
            assert again.options == first.options
    assert short(wire) == file
    (bot,) = hosts["robot/bot"]
    machine = make_offers(lab, agents, {bot.host: "b"}).by_machine["b"]
    assert machine.agents == {"robot": file["robot"][:1]}
    with own_folder(lab, tmp_path / "out", agents, Show()) as out:
        kept = json.loads((out / "run.json").read_text())["agents"]
    assert kept == placed(file)


def test_a_plan_of_an_older_recording_is_read(tmp_path: Path) -> None:
    """Its options stand beside the name."""
    (tmp_path / "follow.py").write_text(FOLLOW)
    follow = {"name": "a", "type": "follow.py:Follow", "target": "robot/bot/state"}
    now = {**follow, "every": 2, "options": {"gain": 2.5}}
    assert nested("process", {**follow, "every": 2, "gain": 2.5}, tmp_path) == now
    assert nested("process", now, tmp_path) == now
    (plan,) = read_plans({"process": [now]}, tmp_path, 0.1)
    assert plan.options == {"gain": 2.5}
    with pytest.raises(WireError, match="no other words"):
        list(read_plans({"process": [{**now, "gain": 2.5}]}, tmp_path, 0.1))
    robot = {"name": "bot", "definition": "a.py:A", "parameters": {"track": 0.1}}
    assert nested("robot", robot, tmp_path) == robot
    hall = nested("world", {"name": "hall", "radius": 2.0}, tmp_path)
    assert hall == {"name": "hall", "options": {"radius": 2.0}}

"""Recordings of experiments, for tests that do them again."""

from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents import registry
from rems_net.agents.experiment.show import Show
from rems_net.cli.script import run_script

#: the last line of a rerun without differences ends so
SAME = "are the same, to the bit."
#: three agents: an input, a robot with noise of its own, a process; `{...}` is changed
AGENTS = """
from rems_net import Definition, Experiment, In, Input, Out, Process, Schema, Settings
from rems_net.units import length, number, velocity

PUSH = Schema("again.push", {"speed": velocity()})


class Wave(Input):
    value = Out(PUSH)

    def read(self, tick):
        return {"speed": 0.5 + 0.125 * (tick.n % 4)}


class Sled(Definition):
    parameters = Settings(drag=number(default=0.25))
    command = In(PUSH)
    state = Out(Schema("again.state", {"x": length(), "y": length()}))
    sensors = Out(Schema("again.sensors", {"front": length(), "on": number()}))

    def derivative(self, state, command):
        return {"x": command["speed"] - self.parameters.drag, "y": 0.125}

    def measure(self, state, command):
        return {"front": 2.0 - state["x"], "on": float(state["x"] > 0.25)}


class Watch(Process):
    options = Settings(most=number(default=0.3))
    sled = In(Sled.state)
    value = Out(Schema("again.seen", {"gap": length(), "late": number()}))

    def step(self, tick):
        self.value = {
            "gap": self.options.most - self.sled.x + 0.5 * self.random.random(),
            "late": float(tick.n > 10),
        }


if __name__ == "__main__":
    lab = Experiment("again", dt="50 ms", duration="1 s", seed=5)
    lab.input("wave", Wave)
    lab.robot("sled", Sled, "kinematic", command="input/wave")
    lab.process("watch", Watch, sled="robot/sled/state")
    lab.output("rec", "mcap")
    lab.run()
"""


def recorded(lab: Experiment, folder: Path, *, direct: bool = True) -> Path:
    """Record an experiment in a folder; return its file."""
    if not any(
        cls.__name__ == "McapOutput" for p in lab.plans.values() for cls in p.classes
    ):
        lab.output("recorder", "mcap")
    lab.run(folder, direct=direct, show=Show())
    return folder / "run.mcap"


def scripted(path: Path, folder: Path) -> None:
    """Record the experiment that a script runs, in a folder."""

    def runner(lab: Experiment, *_: Any, **__: Any) -> None:
        with registry.running_by(None):
            recorded(lab, folder)
        raise registry.ScriptEnd

    with pytest.raises(registry.ScriptEnd):
        run_script(path, [], runner)

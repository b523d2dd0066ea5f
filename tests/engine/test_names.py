"""Users' attributes have any name that is not taken; a taken one is refused."""

from typing import Any

import pytest

from rems_net import Experiment
from rems_net.errors import ExperimentError

#: what runs once kept on the user's own objects
FREE: tuple[str, ...] = (
    "every",
    "feedback",
    "heard",
    "said",
    "origin",
    "seed",
    "touched",
)
FREE += ("in_step", "stopped", "lease", "n", "badge", "source_tick", "written")
TAKEN = ("jobs", "tick", "random", "key", "name", "restarts", "options")


def agents(name: str, value: Any = 5) -> dict[str, Any]:
    """Return a class of each kind that sets an attribute of this name."""
    scope: dict[str, Any] = {"__name__": __name__}
    text = f"""
from rems_net import *
from tests.engine.parts import COMMAND, STATE

class Cart(Definition):
    command, state = In(COMMAND), Out(STATE)

class Mover(Driver):
    def open(self):
        self.{name} = {value!r}
    def drive(self, command, dt):
        assert self.{name} == {value!r}
        self.state.x += command.speed * dt
    def sense(self):
        pass

class Keys(Input):
    value = Out(COMMAND)
    def open(self):
        self.{name} = {value!r}
    def read(self, tick):
        assert self.{name} == {value!r}
        return {{"speed": 0.5, "turn": 0.0}}

class Filter(Process):
    state, value = In(STATE), Out(STATE)
    def open(self):
        self.{name} = {value!r}
    def step(self, tick):
        assert self.{name} == {value!r}
        self.value = self.state

class Log(Output):
    state = In(STATE)
    def open(self):
        self.{name} = {value!r}
    def write(self, tick):
        assert self.{name} == {value!r}
"""
    exec(compile(text, __file__, "exec"), scope)
    return scope


def lab(name: str) -> Experiment:
    of = agents(name)
    made = Experiment("names", dt=0.1, duration=1.0)
    made.input("keys", of["Keys"])
    made.robot("sim", of["Cart"], of["Mover"], command="input/keys")
    made.process("filter", of["Filter"], state="robot/sim/state")
    made.output("log", of["Log"], state="robot/sim/state")
    return made


@pytest.mark.parametrize("name", FREE)
def test_a_free_name_changes_nothing(name: str, tmp_path: Any) -> None:
    with lab(name).engine(out=tmp_path) as engine:
        engine.run()
        assert engine["sim"].state.x == pytest.approx(0.5)


@pytest.mark.parametrize("name", TAKEN)
def test_a_taken_name_is_refused_with_another(name: str) -> None:
    with pytest.raises(ExperimentError, match=rf"call it self\.my_{name}\."):
        lab(name)

"""Classes as beginners write them: one sentence, which names the line to mend."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents import registry
from rems_net.agents.tick import Tick
from rems_net.errors import AgentError, RemsError, uncoded

HEAD = """\
from rems_net import Definition, In, Input, Out, Output, Process, Schema, Settings
from rems_net.defdict import angle, angular_velocity, length, number, velocity
from rems_net.units import deg, s

COMMAND = Schema("command", {"speed": velocity(), "turn": angular_velocity()})
STATE = Schema("state", {"x": length(), "heading": angle()})
"""
LINE = HEAD.count("\n") + 1
AT, LATER = (f"(mine.py, line {LINE + n})" for n in (2, 5))
CART = """\
class Cart(Definition):
    command, state = In(COMMAND), Out(STATE)
"""
MOVES = "    def derivative(self, state, command):\n        return "
SENSES = (
    CART
    + '    sensors = Out(Schema("sensors", {"range": length()}))\n'
    + MOVES
    + "{}\n"
)
DEGREES = CART.replace("STATE", 'Schema("state", {"heading": angle("deg")})')
INSTEAD = (
    "it is built from its name and settings, in a process of its own. Leave __init__ "
    "out: declare its settings by `options = Settings(...)`, and make what it needs "
    "in `def open(self)`."
)
RATES = '{"x": 0.1}, the rate of each field that changes'
WEAVE = "class Weave(Input):\n    value = Out(COMMAND)\n"
PILOT = (
    "class Pilot(Process):\n    seen = In(STATE)\n    value = Out(COMMAND)\n"
    "    options = Settings(gain=number())\n"
    "    def step(self, tick):\n        self.value = {}\n"
)
READ = "    def read(self, tick):\n        return {}\n"

Add = Callable[[Experiment, type], None]


def robot(lab: Experiment, cls: type) -> None:
    lab.robot("sim", cls, "kinematic")


def stick(lab: Experiment, cls: type) -> None:
    lab.input("stick", cls)


def pilot(**settings: Any) -> Add:
    return lambda lab, cls: lab.process("pilot", cls, **settings)


def diary(lab: Experiment, cls: type) -> None:
    lab.output("diary", cls)


def only_class(folder: Path, text: str) -> type:
    """The class that a user's file defines."""
    (folder / "mine.py").write_text(HEAD + text)
    return registry.load(f"mine.py:{text.split('(')[0].removeprefix('class ')}", folder)


@pytest.mark.parametrize(
    ("text", "add", "sentence"),
    [
        (
            CART + MOVES.replace("return ", "") + "{}\n",
            robot,
            f"Cart.derivative {AT} returns None; expected a dict "
            f"such as {RATES}. Is `return` missing?",
        ),
        (
            CART + MOVES + '"x = speed"\n',
            robot,
            f"Cart.derivative {AT} returns 'x = speed'; expected "
            f"a dict such as {RATES}.",
        ),
        (
            CART + MOVES + '{"x": "fast"}\n',
            robot,
            f"'x' of Cart.derivative {AT} expects a number in "
            "m/s, but got 'fast'. Type a number, such as 1.5 or \"1.5 m/s\".",
        ),
        (
            CART + MOVES + '{"x": None}\n',
            robot,
            f"Cart.derivative {AT} returns None for 'x'; expected a number in m/s.",
        ),
        (
            CART + "    def derivative(self, state):\n        return {}\n",
            robot,
            f"Cart.derivative {AT} is `def derivative(self, state)"
            "`; expected `def derivative(self, state, command)`.",
        ),
        (
            CART + MOVES.replace("return ", "") + 'state["x"] += command["speed"]\n',
            robot,
            f"Cart.derivative {AT} sets state['x'] (mine.py, line "
            f"{LINE + 3}, in derivative), and can only read it; return a dict such as "
            f"{RATES}.",
        ),
        (
            CART + MOVES.replace("return ", "") + "command.speed = 1.0\n",
            robot,
            f"Cart.derivative {AT} sets command['speed'] (mine.py, line {LINE + 3}, in "
            f"derivative), and can only read it; return a dict such as {RATES}.",
        ),
        (
            DEGREES + MOVES + '{"heading": command["turn"]}\n',
            robot,
            f"Cart.derivative {AT} returns 0.0 for 'heading', and "
            "the state has it in deg: that could be in rad/s or in deg/s. Write "
            'the unit, such as "0.5 rad/s" or 30 * deg / s, or have it in rad: '
            "angle().",
        ),
        (
            DEGREES + MOVES + '{"heading": "1 m/s"}\n',
            robot,
            f"'heading' of Cart.derivative {AT} expects a number "
            "in deg/s, but got '1 m/s': m/s (velocity) cannot become deg/s (angular "
            'velocity). Type a number in deg/s, or a text such as "1.5 deg/s".',
        ),
        (
            SENSES + "    def measure(self, state, command):\n        {}\n",
            robot,
            f"Cart.measure {LATER} returns None; expected a dict such "
            'as {"range": 1.0}, what each sensor reads. Is `return` missing?',
        ),
        (
            SENSES + "    def measure(self):\n        return {}\n",
            robot,
            f"Cart.measure {LATER} is `def measure(self)`; expected "
            "`def measure(self, state, command)`.",
        ),
        (
            WEAVE + "    def __init__(self):\n        self.n = 0\n" + READ,
            stick,
            f"Weave.__init__ {AT} is `def __init__(self)`; {INSTEAD}",
        ),
        (
            WEAVE
            + "    def __init__(self, name, **more):\n        self.n = 0\n"
            + READ,
            stick,
            f"Weave.__init__ {AT} does not call super().__init__; {INSTEAD}",
        ),
        (
            WEAVE + "    def prepare(self):\n        self.n = 0\n" + READ,
            stick,
            f"Weave.prepare {AT} does not call super().prepare(), "
            "which makes value and all its ports; write that as its first line.",
        ),
        (
            WEAVE + "    def read(self):\n        return {}\n",
            stick,
            f"Weave.read {AT} is `def read(self)`; expected `def read(self, tick)`.",
        ),
        (
            WEAVE + "    def read(tick):\n        return {}\n",
            stick,
            f"Weave.read {AT} is `def read(tick)`; expected `def read(self, tick)`.",
        ),
        (
            WEAVE + READ,
            lambda lab, cls: lab.input("stick", cls("stick")),
            "input is an instance of Weave; expected the class itself, which is built "
            "in a process of its own: write Weave, without parentheses.",
        ),
        (
            WEAVE + READ,
            lambda lab, cls: lab.input("stick", cls()),
            "input is an instance of Weave; expected the class itself, which is built "
            "in a process of its own: write Weave, without parentheses.",
        ),
        (
            PILOT,
            pilot(seen="robot/sim/state", gain=2, host="a"),
            'gain belongs in the options of Pilot; write options={"gain": 2}.',
        ),
        (
            PILOT,
            pilot(sen="robot/sim/state"),
            "there is no setting 'sen'; beside its name it may have seen, options "
            "(gain), every, since, host, machine, restart, rules. Did you mean 'seen'?",
        ),
    ],
    ids=[
        "derivative without return",
        "derivative returns text",
        "a rate that is text",
        "a rate that is None",
        "derivative with another signature",
        "the state is set",
        "the command is set",
        "degrees and a plain number",
        "a rate in another unit",
        "measure without return",
        "measure with another signature",
        "an own __init__",
        "an own __init__ without super",
        "prepare without super",
        "read without tick",
        "read without self",
        "an instance",
        "an instance without a name",
        "an option of a process beside its name",
        "a mistyped In",
    ],
)
def test_one_sentence(tmp_path: Path, text: str, add: Add, sentence: str) -> None:
    cls = only_class(tmp_path, text)
    lab = Experiment("mine", duration=1, folder=tmp_path)

    def check() -> None:
        add(lab, cls)
        lab.check()

    with pytest.raises(RemsError) as caught:
        check()
    assert uncoded(caught.value).partition("': ")[2] == sentence


@pytest.mark.parametrize(
    ("returned", "shown"),
    [('"notes.txt"', "'notes.txt'"), ("None", "None"), ("[1]", "[1]")],
)
def test_what_an_output_has_made(tmp_path: Path, returned: str, shown: str) -> None:
    text = f"""\
class Diary(Output):
    state = In(source="robot/sim/state")

    def write(self, tick):
        pass

    def made(self):
        return {returned}
"""
    lab = Experiment("mine", duration=1, folder=tmp_path)
    lab.robot("sim", "woodbot", "kinematic")
    lab.output("diary", only_class(tmp_path, text))
    with pytest.raises(AgentError) as caught, lab.engine(tmp_path / "out") as engine:
        engine.step()
    assert str(caught.value) == (
        f"output/diary: Diary.made (mine.py, line {LINE + 6}) returns {shown}; "
        "expected a list of paths, such as [self.path]."
        " (R0503)"
    )


@pytest.mark.parametrize("integrator", ["euler", "rk4"])
@pytest.mark.parametrize(
    "rate", ['"0.5 rad/s"', "30 * deg / s", "(command['turn'] + 30) * deg / s"]
)
def test_rates_with_units_are_converted(
    tmp_path: Path, integrator: str, rate: str
) -> None:
    text = DEGREES + MOVES + f'{{"heading": {rate}}}\n'
    lab = Experiment("mine", dt="0.1 s", duration=1, folder=tmp_path)
    lab.robot(
        "sim",
        only_class(tmp_path, text),
        "kinematic",
        options={"integrator": integrator},
    )
    sim = lab.check()["robot/sim"]
    for n in range(10):
        sim.step(Tick(n, n * 0.1, 0.1))
    expected = 28.64788975654116 if "0.5" in rate else 30.0
    assert sim.state.heading == pytest.approx(expected)  # type: ignore[attr-defined]

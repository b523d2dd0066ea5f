"""Classes that would silently do nothing, or the wrong thing: refused, or told."""

import re
from pathlib import Path

import pytest

from rems_net.cli import main
from tests.agents.scripts import HAND, LAB, script

CLASSES = """
class Hand(Input):
    value = Out(VALUE)

    def read(self, tick):
        return {"wheel/left": 50}


class Follow(Process):
    leader = In(VALUE)
    command = Out(VALUE)

    def step(self, tick):
        self.command = {"wheel/right": self.leader["wheel/left"]}


class Notes(Output):
    robot = In(Schema("state", {"x": length(), "y": length(), "heading": angle()}))

    def write(self, tick):
        pass


class Cart(Definition):
    command = In(Schema("command", {"speed": velocity()}))
    state = Out(Schema("state", {"x": length()}))


class Wheels(Driver):
    def drive(self, command, dt):
        self.state["x"] += command["speed"] * dt

    def sense(self):
        pass


"""
IMPORTS = """\
from rems_net import Definition, Driver
from rems_net.defdict import angle, length, velocity
"""
ALL = """
lab = Experiment("lab", duration="1 s")
lab.input("hand", Hand)
lab.process("follow", Follow, leader="input/hand")
lab.robot("sim", "woodbot", "kinematic", command="process/follow")
lab.robot("cart", Cart, Wheels)
lab.output("notes", Notes, robot="robot/sim/state")
"""


def text(old: str, new: str, run: str = "lab.run(pace=20)\n") -> str:
    assert old in CLASSES
    return HAND + IMPORTS + CLASSES.replace(old, new) + ALL + run


def checked(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    script: str,
) -> tuple[int, str]:
    """Return the exit status of `rems check lab.py`, and its complaint."""
    monkeypatch.chdir(folder)
    (folder / "lab.py").write_text(script)
    status = main(["check", "lab.py"])
    assert [path.name for path in folder.iterdir() if path.is_file()] == ["lab.py"]
    return status, capsys.readouterr().err


def test_without_a_mistake_nothing_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert checked(tmp_path, monkeypatch, capsys, text("pass", "pass")) == (0, "")


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            "    value = Out(VALUE)",
            "    out = Out(VALUE)",
            "input 'hand': Hand.out is an Out, and every input has something else by "
            "the name 'out'; give the port another one, such as 'value'.",
        ),
        (
            "leader = In(VALUE)",
            "host = In(VALUE)",
            "process 'follow': Follow.host is an In, and every process has something "
            "else by the name 'host'; give the port another one, such as 'value'.",
        ),
        (
            "def read(",
            "def raed(",
            "input 'hand': Hand has no read(self, tick), so the input would do "
            "nothing. It has 'raed': rename it.",
        ),
        (
            "def step(",
            "def stepp(",
            "process 'follow': Follow has no step(self, tick), so the process would do "
            "nothing. It has 'stepp': rename it.",
        ),
        (
            "def write(",
            "def record(",
            "output 'notes': Notes has no write(self, tick), so the output would do "
            "nothing.",
        ),
        (
            "def drive(",
            "def run(",
            "robot 'cart': Wheels has no drive(self, command, dt), so the robot would "
            "do nothing.",
        ),
        (
            "value = Out(VALUE)",
            "value = In(VALUE)",
            "input 'hand': Hand.value is an In, and an In is read by its agent; write "
            "value = Out(...).",
        ),
        (
            "robot = In(",
            "robot = Out(",
            "output 'notes': Notes.robot is an Out, and an Out is set by its agent; "
            "write robot = In(...).",
        ),
        (
            "command = In(Schema(",
            "command = Out(Schema(",
            "robot 'cart': Cart.command is an Out, and an Out is set by its agent; "
            "write command = In(...).",
        ),
        (
            "state = Out(Schema(",
            "state = In(Schema(",
            "robot 'cart': Cart.state is an In, and an In is read by its agent; write "
            "state = Out(...).",
        ),
        (
            "command = Out(VALUE)",
            "command = In(VALUE)",
            "process 'follow': Follow sets self.command, which is an In: what it "
            "reads. Values for other agents have an Out: command = Out(...).",
        ),
        (
            "self.command = ",
            "self.comand = ",
            "process 'follow': Follow sets self.comand, which nothing reads, and it "
            "has no such port. Did you mean 'command'?",
        ),
        (
            'return {"wheel/left": 50}',
            'self.valeu = {"wheel/left": 50}',
            "input 'hand': Hand sets self.valeu, which nothing reads, and it has no "
            "such port. Did you mean 'value'?",
        ),
        (
            'self.command = {"wheel/right": self.leader["wheel/left"]}',
            'self.command["wheel/left"] = 1\n        return {"wheel/left": 50}',
            "process 'follow': Follow.step returned {'wheel/left': 50}, which goes "
            "nowhere; set its Out: self.command = {'wheel/left': 50}",
        ),
        (
            "    command = Out(VALUE)\n",
            "    command = VALUE\n",
            "process 'follow': command is a Schema, and no port; write command = "
            "Out(Schema(...)).",
        ),
        (
            'state = Out(Schema("state", {"x": length()}))',
            'state = Schema("state", {"x": length()})',
            "robot 'cart': state is a Schema, and no port; write state = "
            "Out(Schema(...)).",
        ),
        (
            "    value = Out(VALUE)",
            '    value, options = Out(VALUE), {"speed": 3}',
            "input 'hand': Hand.options is {'speed': 3}; declare settings by options = "
            "Settings(speed=number(default=3)).",
        ),
        (
            "    value = Out(VALUE)",
            "    value, options = Out(VALUE), Settings(speed=number())\n"
            '    adjustable = ("sped",)',
            "input 'hand': Hand.adjustable is ('sped',); expected names of its "
            "settings, such as (\"speed\",). Did you mean 'speed'?",
        ),
        (
            "    value = Out(VALUE)",
            "    value, options = Out(VALUE), Settings(speed=number())\n"
            '    adjustable = "speed"',
            "input 'hand': Hand.adjustable is 'speed'; expected names of its settings, "
            'such as ("speed",).',
        ),
    ],
)
def test_found_by_a_check(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    old: str,
    new: str,
    sentence: str,
) -> None:
    status, said = checked(tmp_path, monkeypatch, capsys, text(old, new))
    assert (status, said.partition(": ")[0]) == (2, "rems")
    found = said.partition(", line ")[2].partition(": ")[2]
    stood = r"( \((lab\.py, line \d+, in \w+, )?tick 1\))? \(R\d{4}\)\n"
    assert found.startswith(sentence)
    assert re.fullmatch(stood, found.removeprefix(sentence))


def test_attributes_of_ones_own_are_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`values`, `last_state`: like a port, and used."""
    new = """self.values = [*getattr(self, "values", ()), 1.0]
        self.last_value = {"wheel/left": sum(self.values)}
        return self.last_value"""
    right = text('return {"wheel/left": 50}', new)
    assert checked(tmp_path, monkeypatch, capsys, right) == (0, "")


def test_what_a_run_warns_of(tmp_path: Path) -> None:
    """Outs that are never set, and robots that nothing can command in time."""
    two = "value = Out(VALUE)\n    second = Out(VALUE)"
    run = 'lab.plans["robot/sim"].sources["command"] += "/command"\n'
    run += 'lab.plans["process/follow"].sources["leader"] += "/value"\n'
    run += "lab.record = False\nfor key, plan in lab.plans.items():\n"
    run += '    plan.host = key if key == "input/hand" else "here"\nlab.run()\n'
    never = text("    value = Out(VALUE)", f"    {two}", run)
    never = never.replace('return {"wheel/left": 50}', 'self.second["wheel/left"] = 1')
    assert script(tmp_path, never) == (
        0,
        f"[clock] warning: {IDLE.format('robot/cart')}"
        "[input/hand] warning: input/hand never set 'value'; who reads it saw its "
        "default\n",
    )


IDLE = (
    'nothing commands {}, and at pace "fast" no program outside is in time to: write '
    'such as command = "input/NAME", or run it at pace 1.\n'
)
FAST = "lab.run()\n"
TWO = f'lab.robot("b", "woodbot", "kinematic")\n{FAST}'


@pytest.mark.parametrize(
    ("made", "robots"),
    [
        (text("pass", "pass", FAST), "robot/cart"),
        (text("pass", "pass", TWO), "robot/cart (and 1 more)"),
        (text("velocity()", "velocity(default=1.0)", FAST), ""),
        (HAND + IMPORTS + CLASSES.partition("class Follow")[0] + LAB + FAST, ""),
    ],
    ids=["one", "two", "one that goes by itself", "all are commanded"],
)
def test_a_robot_that_nobody_can_command(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    made: str,
    robots: str,
) -> None:
    said = f"rems: {IDLE.format(robots)}" if robots else ""
    assert checked(tmp_path, monkeypatch, capsys, made) == (0, said)

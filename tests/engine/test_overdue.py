"""A method that does not return before the first tick is named, with its line."""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment, Input, Out, Schema, Tick
from rems_net.agents.background import overdue
from rems_net.cli import main
from tests.agents.scripts import script

#: an agent with one method that does not return until it is named, or for 20 s
AGENT = """
import sys, time
from rems_net import *
from rems_net.defdict import *

def linger():
    end = time.monotonic() + 20
    while "has not returned" not in sys.stderr.getvalue() and time.monotonic() < end:
        pass

class Dot(Definition):
    command = In(Schema("c", {"v": velocity()}))
    state = Out(Schema("s", {"x": length()}))
    def derivative(self, state, command):
        return {"x": command["v"]}

class Hand(Input):
    value = Out(Dot.command)
    def __init__(self, name="", **more):
        super().__init__(name, **more)
    def open(self):
        self.v = 1.0
    def read(self, tick):
        return {"v": self.v}
"""
LAB = """
lab = Experiment("lab", dt=0.1, duration=1, record=False)
lab.input("hand", Hand, every=3)
lab.robot("dot", Dot, "kinematic", command="input/hand", host="here")
lab.run()
"""


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Wait for 0.2 s only; no thread is left behind."""
    monkeypatch.setattr(overdue, "REPORT_AFTER", 0.2)
    yield
    assert "overdue" not in {thread.name for thread in threading.enumerate()}


def sentence(method: str, file: str, text: str, by: str = "warning") -> str:
    """Return what is said of a method in which `linger` is called."""
    line = text.splitlines().index("        linger()") + 1
    return (
        f"{by}: {method} ({file}, line {line}) has not returned for 0.2 s. Is there "
        "a loop without end in it? Ctrl+C ends the run.\n"
    )


def slow(line: str, first: str = "linger()") -> str:
    """Return the agents, with a call before this line."""
    indent = line[: len(line) - len(line.lstrip())]
    assert line in AGENT
    return AGENT.replace(line, f"{indent}{first}\n{line}")


METHODS = [
    ('        return {"x"', "robot/dot: Dot.derivative"),
    ("        self.v", "input/hand: Hand.open"),
    ('        return {"v"', "input/hand: Hand.read"),
]


@pytest.mark.parametrize(("line", "method"), METHODS)
def test_in_an_engine(
    capsys: pytest.CaptureFixture[str], line: str, method: str
) -> None:
    """Of classes that are in no file, as typed at a prompt."""
    scope: dict[str, Any] = {"__name__": "__main__"}
    text = slow(line)
    exec(compile(text, "<stdin>", "exec"), scope)
    lab = Experiment("lab", dt=0.1, duration=1)
    lab.input("hand", scope["Hand"], every=3)
    lab.robot("dot", scope["Dot"], "kinematic", command="input/hand")
    with lab.engine() as engine:
        engine.run()
    assert capsys.readouterr().err == sentence(method, "<stdin>", text)


@pytest.mark.parametrize(
    ("line", "method"),
    [*METHODS, ("        super().__init__", "Hand.__init__")],
)
def test_in_a_check(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    line: str,
    method: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    text = slow(line)
    (tmp_path / "lab.py").write_text(text + LAB)
    assert main(["check", "lab.py"]) == 0
    assert capsys.readouterr().err == sentence(method, "lab.py", text, "rems")


def test_the_top_of_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lab.py").write_text(f"{AGENT}\nlinger()\n")
    (tmp_path / "lab.toml").write_text(
        '[experiment]\nduration = 1\n[[input]]\nname = "hand"\ntype = "lab.py:Hand"\n'
    )
    assert main(["check", "lab.toml"]) == 0
    assert capsys.readouterr().err.startswith(
        f"rems: lab.py, line {AGENT.count(chr(10)) + 2}, has not returned for 0.2 s."
    )


def test_quick_methods_are_left_alone(capsys: pytest.CaptureFixture[str]) -> None:
    """Many that take 0.3 s together, and a caller of the engine that goes on."""
    lab = Experiment("lab", dt=0.1, duration=1)

    class Brief(Input):
        value = Out(Schema("v", {}))

        def open(self) -> None:
            threading.Event().wait(0.1)

        def read(self, tick: Tick) -> None:
            pass

    for name in "abcde":
        lab.input(name, Brief)
    with lab.engine() as engine:
        engine.step()
        threading.Event().wait(0.4)
    assert capsys.readouterr().err == ""


def test_in_a_process(tmp_path: Path) -> None:
    """A host warns on the screen of its run; its script is read by the host, too."""
    text = slow('        return {"v"', "time.sleep(1.5 * (tick.n == 3))")
    text += (
        "\nfrom rems_net.agents.background import overdue\noverdue.REPORT_AFTER = 0.2\n"
    )
    line = text.splitlines().index("        time.sleep(1.5 * (tick.n == 3))") + 1
    assert script(tmp_path, text + LAB) == (
        0,
        f"[input/hand] warning: input/hand: Hand.read (lab.py, line {line}) has not "
        "returned for 0.2 s. Is there a loop without end in it? Ctrl+C ends the run.\n",
    )

"""`rems check` makes the first ticks: mistakes show, and nothing is touched."""

import re
from pathlib import Path

import pytest

from rems_net.agents.experiment.checking import trial
from rems_net.cli import main

#: a process, an input and an output that make no mistake
AGENTS = """\
from pathlib import Path
from rems_net import Experiment, In, Input, Out, Output, Process, Schema, Settings
from rems_net.defdict import array, text, velocity

VALUE = Schema("value", {"speed": velocity(), "row": array((3,))})


class Hand(Input):
    value = Out(VALUE)

    def read(self, tick):
        return {"speed": "1 m/s"}


class Double(Process):
    hand, value = In(VALUE), Out(VALUE)

    def step(self, tick):
        self.value = {"speed": 2 * self.hand["speed"]}


class Notes(Output):
    value = In(VALUE)

    def open(self):
        self.file = (self.out / "notes.txt").open("w")

    def write(self, tick):
        print(self.value["speed"], file=self.file)

    def close(self):
        self.file.close()
"""
TOML = """
[experiment]
duration = "10 s"
pace = 1

[[input]]
name = "hand"
type = "mine.py:Hand"
since = "1 s"

[[process]]
name = "double"
type = "mine.py:Double"
hand = "input/hand"
every = 2

[[output]]
name = "notes"
type = "mine.py:Notes"
value = "process/double"

[[robot]]
name = "sim"
definition = "woodbot"
driver = "kinematic"
"""
SCRIPT = """

lab = Experiment("lab", duration="10 s")
lab.input("hand", Hand, since="1 s")
lab.process("double", Double, hand="input/hand", every=2)
lab.output("notes", Notes, value="process/double")
lab.robot("sim", "woodbot", "kinematic")
lab.run(pace=1)
"""


def checked(
    folder: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, form: str
) -> tuple[int, str]:
    """Check the experiment with this edit: the exit status, and the complaint."""
    assert old in AGENTS
    text = AGENTS.replace(old, new)
    (folder / "mine.py").write_text(text + SCRIPT * (form == "mine.py"))
    (folder / "mine.toml").write_text(TOML)
    before = sorted(folder.rglob("*"))
    status = main(["check", form])
    assert sorted(folder.rglob("*")) == before
    return status, capsys.readouterr().err


@pytest.mark.parametrize("form", ["mine.toml", "mine.py"])
@pytest.mark.parametrize(
    ("old", "new", "agent", "sentence"),
    [
        (
            '"1 m/s"',
            "1 / (11 - tick.n)",
            'input "hand"',
            "ZeroDivisionError: division by zero (mine.py, line 12, in read, tick 11)",
        ),
        (
            '"1 m/s"',
            '"1 kg"',
            'input "hand"',
            "value: 'speed' expects a number in m/s, but got '1 kg': kg (mass) cannot "
            "become m/s (velocity). Type a number in m/s, or a text such as "
            '"1.5 m/s".',
        ),
        (
            '"speed": 2',
            '"row": [1, 2], "speed": 2',
            'process "double"',
            "value: 'row' expects an array of 3 numbers, but got [1, 2]. Its shape is "
            "(2,), not (3,).",
        ),
        (
            '{"speed": 2',
            '{"sped": 2',
            'process "double"',
            "value has no field 'sped'. Did you mean 'speed'?",
        ),
        (
            'self.value["speed"], ',
            'self.value["sped"], ',
            'output "notes"',
            "value has no field 'sped'. Did you mean 'speed'?",
        ),
    ],
)
def test_what_shows_at_the_first_tick(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    form: str,
    old: str,
    new: str,
    agent: str,
    sentence: str,
) -> None:
    status, said = checked(folder, capsys, old, new, form)
    place = f"mine.toml, [[{agent.replace(' ', ']] ')}: "
    if form == "mine.py":
        name = agent.replace('"', "'")
        place = f"mine.py, line {(AGENTS + SCRIPT).count(chr(10))}: {name}: "
    assert status == 2
    expected = f"rems: {place}{sentence}"
    assert said.startswith(expected)
    stood = r"( \((mine\.py, line \d+, in \w+, )?tick \d+\))? \(R\d{4}\)\n"
    assert re.fullmatch(stood, said.removeprefix(expected))


@pytest.mark.parametrize("form", ["mine.toml", "mine.py"])
def test_without_a_mistake_nothing_is_said(
    folder: Path, capsys: pytest.CaptureFixture[str], form: str
) -> None:
    assert checked(folder, capsys, "Notes", "Notes", form) == (0, "")


@pytest.mark.parametrize(
    ("does", "why"),
    [
        ('open("notes.txt", "w")', "would write notes.txt"),
        ('open("notes.txt", "a")', "would write notes.txt"),
        ('Path("notes.txt").unlink()', "would write notes.txt"),
        ('Path("notes.txt").rename("b.txt")', "would write notes.txt"),
        ('open("/dev/ttyUSB7", "rb")', "would open /dev/ttyUSB7"),
        ('__import__("sqlite3").connect("notes.txt")', "would write notes.txt"),
        (
            '__import__("socket").create_connection(("127.0.0.1", 9))',
            "would open a connection",
        ),
    ],
)
def test_what_would_change_something_is_left_out(
    folder: Path, capsys: pytest.CaptureFixture[str], does: str, why: str
) -> None:
    (folder / "notes.txt").write_text("a year's work")
    old = '(self.out / "notes.txt").open("w")'
    status, said = checked(folder, capsys, old, does, "mine.toml")
    assert (status, said) == (0, f"rems: not tried: output/notes ({why})\n")
    assert (folder / "notes.txt").read_text() == "a year's work"


def test_a_file_that_is_opened_too_early(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "notes.txt").write_text("a year's work")
    new = """def __init__(self, *words, **more):
        super().__init__(*words, **more)
        self.file = open("notes.txt", "w")

    def begin("""
    status, said = checked(folder, capsys, "def open(", new, "mine.toml")
    assert (status, said) == (
        2,
        'rems: mine.toml, [[output]] "notes": it would write notes.txt (mine.py, line '
        "27, in __init__) before it is open; do that in open(self)."
        " (R0430)\n",
    )
    assert (folder / "notes.txt").read_text() == "a year's work"


def test_hardware_is_left_out_and_its_controller_is_tried(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = TOML.replace('"woodbot"', '"create2"').replace(
        '"kinematic"', '"create2"\noptions = { port = "/dev/ttyUSB7" }'
    )
    (folder / "mine.toml").write_text(text)
    (folder / "mine.py").write_text(AGENTS)
    assert main(["check", "mine.toml"]) == 0
    said = capsys.readouterr().err
    assert said == "rems: not tried: robot/sim (lives in real time)\n"
    (folder / "mine.py").write_text(AGENTS.replace("2 *", "0 /"))
    assert main(["check", "mine.toml"]) == 2
    assert "ZeroDivisionError" in capsys.readouterr().err


def test_slow_ticks_end(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trial, "MOST", 0.05)
    slow = "__import__('threading').Event().wait(0.05); assert tick.n < 9; "
    read = 'self.value = {"speed": 2'
    status, said = checked(folder, capsys, read, slow + read, "mine.toml")
    assert status == 0
    assert said == "rems: not tried: input/hand (joins later)\n"

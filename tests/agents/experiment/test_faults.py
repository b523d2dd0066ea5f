"""What goes wrong in an agent: one sentence, whole files, and nothing left behind."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net import Experiment
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.plan import HERE
from rems_net.errors import AgentError, RemsError, uncoded
from tests.agents.runs import PARTS, WAS_KILLED, Told, relatives, shared_memory, until
from tests.interrupts import APART, interrupt
from tests.signals import KILL


@pytest.fixture(autouse=True)
def nothing_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """After every test: no process, no note of a router, no shared memory."""
    mark = f"PARTS_MARK={tmp_path}"
    monkeypatch.setenv("PARTS_MARK", str(tmp_path))
    monkeypatch.setenv("PARTS_PARENT", str(os.getpid()))
    yield
    assert not relatives(mark)
    notes = Path(os.environ["XDG_RUNTIME_DIR"], "rems_net")
    assert not notes.exists() or not list(notes.iterdir())


def lab(how: str = "", kind: str = "wrong.py:Bad", **more: object) -> Experiment:
    made = Experiment("faults", dt=0.1, duration=1, folder=PARTS, record=False)
    options = {"how": how} if kind == "wrong.py:Bad" else {}
    made.input("stick", kind, options=options, **more)
    made.input("wave", "parts.py:Wave", host=HERE)
    cart = ("parts.py:Cart", "parts.py:Euler")
    made.robot("cart", *cart, command="input/wave", host=HERE)
    made.output("csv", "csv", host=HERE)
    return made


def ticks_in(path: Path) -> int:
    """How many rows there are; each must be whole."""
    text = path.read_text(encoding="utf-8")
    assert text.endswith("\n")
    rows = [line.split(",") for line in text.splitlines()]
    assert len({len(row) for row in rows}) == 1
    return len(rows) - 1


def _matches(sentence: str, said: str) -> None:
    """One sentence, and the tick where an agent's own code failed."""
    plain = re.sub(r" \(tick \d+\)$|, tick \d+(?=\)$)", "", said)
    plain = re.sub(r"(?<=[.?]) \(wrong\.py, line \d+, in read\)$", "", plain)
    assert re.fullmatch(sentence, plain), said
    assert "\n" not in said


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        (
            "exit",
            r"input/stick: SystemExit: 3 \(wrong\.py, line \d+, in read\)",
        ),
        ("os._exit", r"input/stick: exited with status 7"),
        (
            "segfault",
            # There Python raises an exception for it.
            r"input/stick: OSError: exception: access violation .*"
            if os.name == "nt"
            else r"input/stick: was killed by signal 11",
        ),
        ("job", r"input/stick: ValueError: .*"),
    ],
)
def test_a_bad_step(tmp_path: Path, how: str, sentence: str) -> None:
    told = Told()
    with pytest.raises(AgentError) as caught:
        lab(how).run(tmp_path / "out", show=told)
    _matches(sentence, uncoded(caught.value))
    assert not [line for line in told.lines if "Traceback" in line]
    least = 5 if how == "job" else 4  # a job fails some ticks after its start
    assert ticks_in(tmp_path / "out" / "cart.csv") >= least


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        (
            "list",
            r"input/stick: Bad\.value is set to \[1\.0, 2\.0\]; .* x, name\.",
        ),
        ("number", r"input/stick: Bad\.value is set to 7; .* are x, name\."),
        ("unknown field", r"input/stick: .*'nmae'.* Did you mean 'name'\?"),
        ("nan", r"input/stick: .*\bx\b.*"),
        ("text for a number", r"input/stick: .*\bx\b.*'far'.*"),
        ("second", r"input/stick: .*\bx\b.*"),
        (
            "exit",
            r"input/stick: SystemExit: 3 \(wrong\.py, line \d+, in read\)",
        ),
        (
            "recursion",
            r"input/stick: RecursionError: .* \(wrong\.py, .*, in read\)",
        ),
    ],
)
def test_a_bad_step_in_one_process(tmp_path: Path, how: str, sentence: str) -> None:
    with pytest.raises(AgentError) as caught:
        lab(how).run(tmp_path, direct=True)
    _matches(sentence, uncoded(caught.value))
    assert "tick 5)" in str(caught.value)
    assert ticks_in(tmp_path / "cart.csv") == 4


def test_an_input_may_have_nothing_new(tmp_path: Path) -> None:
    """None at tick 5: the value stays what it was."""
    assert lab("none").run(tmp_path, direct=True).ticks == 10


@pytest.mark.parametrize(
    ("how", "sentence", "rows"),
    [
        (
            "open",
            r"OSError: the stick is not plugged in \(wrong\.py, .*, in open\)",
            0,
        ),
        ("die early", WAS_KILLED, 0),
        (
            "close",
            r"OSError: the stick is stuck \(wrong\.py, line \d+, in close\)",
            10,
        ),
    ],
)
def test_what_fails_beside_the_steps(
    tmp_path: Path, how: str, sentence: str, rows: int
) -> None:
    with pytest.raises(AgentError) as caught:
        lab(how).run(tmp_path, show=Told())
    assert re.fullmatch("input/stick: " + sentence, uncoded(caught.value))
    file = tmp_path / "cart.csv"
    assert (ticks_in(file) if file.exists() else 0) == rows


def test_a_constructor_that_fails_in_its_own_process(tmp_path: Path) -> None:
    with pytest.raises(AgentError) as caught:
        lab(kind="wrong.py:Constructed").run(tmp_path, show=Told())
    assert re.fullmatch(
        r"input/stick: ValueError: no two sticks are alike \(wrong\.py, .*__init__\)",
        uncoded(caught.value),
    )


def test_a_constructor_that_fails_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("PARTS_PARENT")
    with pytest.raises(RemsError) as caught:
        lab(kind="wrong.py:Constructed").run(tmp_path, show=Told())
    assert "input 'stick': " in str(caught.value)
    assert "ValueError: no two sticks are alike (wrong.py, line " in str(caught.value)


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        ("class Mine(Input:\n", r"input 'stick': .*mine\.py, line 1: .*"),
        (
            "import nonsuch\n",
            r"input 'stick': ModuleNotFoundError: No module named 'nonsuch' "
            r"\(mine\.py, line 1, in <module>\)",
        ),
        (
            "x = 1\nx / 0\n",
            r"input 'stick': ZeroDivisionError: division by zero "
            r"\(mine\.py, line 2, in <module>\)",
        ),
        ("x = 1\n", r"input 'stick': mine\.py has no class 'Mine'\."),
    ],
)
def test_a_file_that_cannot_be_loaded(
    tmp_path: Path, source: str, sentence: str
) -> None:
    (tmp_path / "mine.py").write_text(source, encoding="utf-8")
    made = Experiment("bad", dt=0.1, duration=1, folder=tmp_path)
    with pytest.raises(RemsError) as caught:
        made.input("stick", "mine.py:Mine")
    assert re.fullmatch(sentence, uncoded(caught.value)), str(caught.value)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no limit of a file's size")
def test_a_full_disk(tmp_path: Path) -> None:
    made = lab()
    made.output("full", "wrong.py:Full", host="full")
    for plan in made.plans.values():
        plan.out = tmp_path
    del made.plans["output/csv"]
    made.duration, made.record = 100.0, False
    with pytest.raises(AgentError) as caught:
        made.run(tmp_path / "out", show=Told())
    assert re.fullmatch(
        r"output/full: cannot write .*cart\.csv: "
        r"(File too large|No space left on device).*",
        str(caught.value),
    )
    assert ticks_in(tmp_path / "out" / "cart.csv") > 10


# -- the whole run in a process of its own -------------------------------------------

SCRIPT = """
from rems_net import Experiment
lab = Experiment("spin", dt=0.01, duration="600 s", pace=1, folder={folder!r})
lab.record = False
lab.input("spin", "parts.py:{kind}")
lab.input("wave", "parts.py:Wave", host="rest")
cart = ("parts.py:Cart", "parts.py:Euler")
lab.robot("cart", *cart, command="input/wave", host="rest")
for i in range({more}):
    lab.input(f"spin{{i}}", "parts.py:{kind}")
lab.output("csv", "csv", host="rest")
lab.run("out")
"""


#: seconds in which a run has ended that is told to: two for who does not listen, and
#: what a busy machine takes, where those who spin have every core
ENDED = 10.0
STARTED: list[subprocess.Popen[str]] = []


@pytest.fixture(autouse=True)
def nobody_stays(tmp_path: Path) -> Iterator[None]:
    """A test that fails leaves no process behind either."""
    yield
    while STARTED:
        process = STARTED.pop()
        process.kill()
        process.wait()
    for pid in relatives(f"PARTS_MARK={tmp_path}"):
        os.kill(pid, KILL)


def start(folder: Path, kind: str, more: int = 0) -> subprocess.Popen[str]:
    script = folder / "lab.py"
    text = SCRIPT.format(folder=str(PARTS), kind=kind, more=more)
    script.write_text(text, encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, str(script)],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
        **APART,
    )
    STARTED.append(process)
    rows = folder / "out" / "cart.csv"
    try:
        until(lambda: rows.exists() and rows.read_bytes().count(b"\n") >= 5, 60)
    except AssertionError:
        process.kill()
        raise AssertionError(process.communicate()) from None
    return process


def test_ctrl_c_while_agents_spin(tmp_path: Path) -> None:
    """Nothing is in shared memory, so nothing is left there, whoever is killed when."""
    process = start(tmp_path, "Spin", 1)
    mark = f"PARTS_MARK={tmp_path}"
    assert len(relatives(mark)) == 4
    assert shared_memory(mark) == set()
    interrupt(process)
    process.communicate(timeout=ENDED)
    assert process.returncode != 0
    assert not relatives(mark)
    assert 4 <= ticks_in(tmp_path / "out" / "cart.csv") <= 5 + AHEAD


def test_a_killed_parent_while_an_agent_spins(tmp_path: Path) -> None:
    process = start(tmp_path, "Spin")
    process.kill()
    process.communicate()
    until(lambda: not relatives(f"PARTS_MARK={tmp_path}"))
    assert 4 <= ticks_in(tmp_path / "out" / "cart.csv") <= 5 + AHEAD
    for note in Path(os.environ["XDG_RUNTIME_DIR"], "rems_net").iterdir():
        note.unlink()  # what a killed process leaves; the next to look removes it

"""`rems run`: from a file to CSV files, a picture and a table; and every way to end."""

import csv
import os
import signal
import time
from pathlib import Path

import pytest

from tests.agents.runs import calm, quiet
from tests.cli.conftest import LAB, together
from tests.commands import Agents, Gone, Run, Start
from tests.interrupts import interrupt_all

TWO = """
[[robot]]
name = "wide"
definition = "woodbot"
driver = "kinematic"
command = "input/keys"
parameters = { track = "0.2 m" }
"""


def read(path: Path) -> tuple[list[str], list[list[float]]]:
    """Header and rows; fails on a row that is not whole."""
    text = path.read_text()
    assert text.endswith("\n")
    header, *rows = csv.reader(text.splitlines())
    assert rows
    assert {len(row) for row in rows} == {len(header)}
    return header, [[float(cell) for cell in row] for row in rows]


def test_one_robot(folder: Path, program: Run) -> None:
    (folder / "lab.toml").write_text(together(LAB))
    done = program("run", "lab.toml", "--out", "results")
    assert (done.returncode, done.stderr) == (0, "")
    header, rows = read(folder / "results" / "model.csv")
    assert header[:6] == [
        "time [s]",
        "command/wheel/left [rad/s]",
        "command/wheel/right [rad/s]",
        "state/x [m]",
        "state/y [m]",
        "state/heading [rad]",
    ]
    assert [row[0] for row in rows] == [n / 10 for n in range(1, 11)]
    assert [row[1:3] for row in rows] == [[1.0, 2.0]] * 5 + [[3.0, 4.0]] * 5
    assert f"files    {Path('results/model.csv')}" in done.stdout
    assert "picture" not in done.stdout


def test_two_robots_are_compared(folder: Path, rems: Run) -> None:
    lab = folder / "lab.toml"
    lab.write_text(lab.read_text() + TWO)
    done = rems("run", "--direct", "lab.toml")
    assert (done.returncode, done.stderr) == (0, "")
    picture = folder / "runs" / "lab" / "comparison.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert f"picture  {Path('runs/lab/comparison.png')}" in done.stdout
    assert "model - wide" in done.stdout
    assert all(len(line) <= 80 for line in done.stdout.splitlines())
    again = rems("compare", "runs/lab")
    assert again.returncode == 0
    assert again.stdout.splitlines()[-1] == done.stdout.splitlines()[-1]


def test_what_was_recorded_can_be_played(folder: Path, rems: Run) -> None:
    """A recording replayed gives the same recording, byte for byte."""
    assert rems("run", "--direct", "lab.toml", "--out", "first").returncode == 0
    lab = folder / "lab.toml"
    lab.write_text(lab.read_text().replace("keys.csv", "first/model.csv"))
    assert rems("run", "--direct", "lab.toml", "--out", "second").returncode == 0
    first, second = (folder / name / "model.csv" for name in ("first", "second"))
    assert first.read_bytes() == second.read_bytes()


def test_pace(folder: Path, rems: Run) -> None:
    (folder / "lab.toml").write_text(together(LAB, "here"))
    begun = time.monotonic()
    done = rems("run", "lab.toml", "--pace", "2")
    assert done.returncode == 0
    assert time.monotonic() - begun > 0.5
    assert "2 x real time" in done.stdout


@pytest.fixture
def long(folder: Path) -> None:
    """The experiment lasts a minute, in real time."""
    lab = folder / "lab.toml"
    text = lab.read_text().replace('"1 s"', '"60 s"\npace = 1.0')
    lab.write_text(text)


@pytest.mark.usefixtures("long")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_interrupted(
    folder: Path, start: Start, agents: Agents, gone: Gone, how: signal.Signals
) -> None:
    if how == signal.SIGTERM:
        if os.name == "nt":
            pytest.skip("Windows has no signal by which a program could end itself")
        (folder / "lab.toml").write_text(together((folder / "lab.toml").read_text()))
    process = start("run", "lab.toml")
    who = agents(ticks=3)
    begun = calm()
    # A terminal sends Ctrl+C to every process of the group; kill sends to one.
    interrupt_all(process) if how == signal.SIGINT else process.send_signal(how)
    _, said = process.communicate(timeout=20)
    assert calm() - begun < 3
    assert process.returncode == 130
    assert quiet(said).startswith("rems: Interrupted after tick ")
    assert said.endswith(f"what the outputs had written is in {Path('runs/lab')}.\n")
    _, rows = read(folder / "runs" / "lab" / "model.csv")
    assert len(rows) >= 3
    gone(who)


FAULTY = """
from rems_net import Input, Out, Schema
from rems_net.defdict import percent

class Faulty(Input):
    value = Out(Schema("faulty", {"wheel": {"left": percent(), "right": percent()}}))

    def read(self, tick):
        return {"wheel/left": 1 / (5 - tick.n)}
"""


def test_an_agent_that_raises(folder: Path, rems: Run) -> None:
    (folder / "faulty.py").write_text(FAULTY)
    lab = folder / "lab.toml"
    text = together(LAB).replace('type = "csv"\noptions.file = "keys.csv"', "")
    lab.write_text(
        text.replace('name = "keys"', 'name = "keys"\ntype = "faulty.py:Faulty"')
    )
    done = rems("run", "lab.toml")
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        "rems: Ended after tick 4 (0.40 s); what the outputs had written is in "
        f"{Path('runs/lab')}.",
        "rems: input/keys: ZeroDivisionError: division by zero (faulty.py, line 9, in "
        "read, tick 5) (R0520)",
    ]
    _, rows = read(folder / "runs" / "lab" / "model.csv")
    assert [row[0] for row in rows][:4] == [n / 10 for n in range(1, 5)]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk(folder: Path, rems: Run) -> None:
    (folder / "results").mkdir()
    (folder / "results" / "model.csv").symlink_to("/dev/full")
    (folder / "lab.toml").write_text(together(LAB))
    done = rems("run", "lab.toml", "--out", "results")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == (
        f"rems: output/log: cannot write {folder}/results/model.csv: No space left on "
        "device; make room there, or name another folder: rems run --out (R0801)"
    )

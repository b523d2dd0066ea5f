"""A run's folder: its own, never mixed with an older run's, nobody's file lost."""

import json
import os
import threading
from pathlib import Path
from typing import Any

import pytest

import rems_net
from rems_net import Experiment, In, Output
from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.checking.connections import shown
from rems_net.agents.experiment.placement.needs import source_digest
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.tick import Tick
from rems_net.errors import AgentError, ExperimentError
from rems_net.events import Event
from rems_net.maths.numerics import describe, environment
from tests.agents.runs import in_one_host, until

#: where the runs of this experiment write, as this system writes a path
LAB = Path("runs/lab")
KEYS = "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]\n"


class Told(Show):
    """Remembers what a run tells, and when it has begun."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.begun = threading.Event()

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        self.clock = clock
        self.begun.set()

    def say(self, source: str, event: Event) -> None:
        if event.kind not in ("held", "late"):  # a busy machine's own
            self.lines.append(f"[{source}] {event}")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the user is."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def lab(rows: str = "1,1,1\n", host: str = HERE, **more: Any) -> Experiment:
    Path("keys.csv").write_text(KEYS + rows, encoding="utf-8")
    made = Experiment("lab", **{"duration": "0.3 s", **more})
    made.input("keys", "csv", options={"file": "keys.csv"})
    made.robot("sim", "woodbot", "kinematic", command="input/keys")
    made.output("log", "csv")
    return in_one_host(made, host)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_what_was_there_is_moved_and_told(here: Path) -> None:
    runs, told = here / "runs", Told()
    lab().run(show=told)
    assert told.lines == []
    (runs / "lab" / "notes.txt").write_text("mine")
    first = (runs / "lab" / "sim.csv").read_bytes()
    made = lab()
    made.robot("other", "woodbot", "kinematic", host=HERE)
    made.run(show=told)
    # Of robot/other it is said, too, that nothing commands it.
    assert told.lines[-1] == f"[run] what was in {LAB} is now in {LAB}.1"
    assert names(runs / "lab.1") == ["notes.txt", *FILES]
    assert (runs / "lab.1" / "sim.csv").read_bytes() == first
    assert names(runs / "lab") == ["other.csv", *FILES]
    lab().run(show=told)
    assert told.lines[-1] == f"[run] what was in {LAB} is now in {LAB}.2"
    assert names(runs) == ["lab", "lab.1", "lab.2"]


def test_an_older_recording_in_the_usual_folder_is_moved_too(here: Path) -> None:
    old = here / "runs" / "lab" / "old.csv"
    old.parent.mkdir(parents=True)
    old.write_text("time [s],state/x [m]\n1,1\n")
    lab().run(show=Told(), direct=True)
    assert names(here / "runs" / "lab") == FILES
    assert names(here / "runs" / "lab.1") == ["old.csv"]


def test_a_folder_of_the_user_keeps_what_is_his(here: Path) -> None:
    """With `--out .` only what a run has made is moved."""
    box, told = here / "box", Told()
    box.mkdir()
    (box / "mine.txt").write_text("mine")
    lab().run(box, show=told, direct=True)
    (box / "later.py").write_text("mine, too")
    (box / "plot.png").write_text("a picture of the first")
    lab().run(box, show=told, direct=True)
    assert told.lines == ["[run] what an earlier run left in box is now in box.1"]
    assert names(box) == ["later.py", "mine.txt", *FILES]
    assert names(here / "box.1") == ["plot.png", *FILES]
    mine = here / "other"
    mine.mkdir()
    (mine / "sim.csv").write_text("mine")
    with pytest.raises(AgentError) as caught:
        lab().run(mine, show=Told(), direct=True)
    assert str(caught.value) == (
        f"output/log: {mine / 'sim.csv'} is there already, and no earlier run has "
        "left it; move it, or give this run a folder of its own (R0801)"
    )
    assert (mine / "sim.csv").read_text() == "mine"


def test_two_runs_at_once_never_write_one_file(here: Path) -> None:
    told, failed = Told(), []

    def run() -> None:
        try:
            lab(duration="60 s", pace=1.0).run(show=told)
        except Exception as error:
            failed.append(error)

    first = threading.Thread(target=run)
    first.start()
    assert told.begun.wait(30)
    assert told.clock is not None
    clock = told.clock
    until(lambda: clock.tick.n > 0)
    try:
        with pytest.raises(ExperimentError) as caught:
            lab().run(show=Told())
    finally:
        clock.pacing.end()
        first.join(30)
    assert str(caught.value) == (
        f"another run that still goes on writes to {LAB}; end that one "
        "(`rems clock end`), or give this one another name or folder."
        " (R0414)"
    )
    assert failed == []
    assert names(here / "runs") == ["lab"]
    lab().run(show=Told(), direct=True)  # it is free again


def test_a_run_does_not_move_what_it_plays(here: Path) -> None:
    lab().run(show=Told(), direct=True)
    again = lab()
    again.plans["input/keys"].options = {"file": "runs/lab/sim.csv"}
    with pytest.raises(ExperimentError) as caught:
        again.run(show=Told())
    assert str(caught.value) == (
        f"this run plays {LAB / 'sim.csv'}, and {LAB} is where it would write; give "
        "the experiment another name or folder."
        " (R0414)"
    )
    assert names(here / "runs") == ["lab"]


FILES = ["run.json", "run.mcap", "sim.csv"]
#: start, direction and reach of the rays of a Woodbot
RAYS = {
    "lidar/front": [0.00825, 0.0, 0.0063, 1.0, 0.0, 0.0, 1.2],
    "lidar/right": [-0.03575, 0.0, 0.0063, 0.0, -1.0, 0.0, 1.2],
}
OUTLINE = (
    "-0.07575,-0.0396 -0.02,-0.0578 0.02,-0.0578 0.02,0.0578 -0.02,0.0578 "
    "-0.07575,0.0396"
)


def test_what_a_folder_says_of_its_run(here: Path) -> None:
    made = lab(host="all")
    made.plans["robot/sim"].initial = {"x": "20 cm"}
    made.run(show=Told())
    told = json.loads((here / "runs/lab/run.json").read_text())
    assert told.pop("fields")  # by the digests of schemas
    assert told == {
        "experiment": "lab",
        "robots": {
            "sim": {
                "time": 0.0,
                "state": {
                    "state/x [m]": 0.2,
                    "state/y [m]": 0.0,
                    "state/heading [rad]": 0.0,
                },
                "arena": 0.4,
                "outline": OUTLINE,
                "world": "",
                "rays": RAYS,
            }
        },
        "files": ["run.mcap", "sim.csv"],
        "seed": 0,
        "numerics": describe(environment(os.environ)),
        "agents": {
            "input": [
                {
                    "name": "keys",
                    "type": "rems_net.inputs.csv:CsvInput",
                    "options": {"file": "keys.csv"},
                }
            ],
            "robot": [
                {
                    "name": "sim",
                    "definition": "rems_net.robots.woodbot:Woodbot",
                    "driver": "rems_net.drivers.kinematic.kinematic:Kinematic",
                    "initial": {"x": 0.2},
                    "command": "input/keys",
                }
            ],
            "output": [
                {"name": "log", "type": "rems_net.outputs.csv:CsvOutput"},
                {"name": "recorder", "type": "rems_net.outputs.mcap:McapOutput"},
            ],
        },
        "worlds": {},
        "dt": 0.1,
        "pace": 0.0,
        "ticks": 3,
        "sources": {"keys.csv": source_digest(Path("keys.csv").read_bytes())},
        "versions": {"rems_net": rems_net.__version__},
    }


@pytest.mark.usefixtures("here")
def test_values_out_of_range_are_told_with_their_lines() -> None:
    made = lab("0.1,9,1\n0.2,1,1\n0.3,1,-8\n0.4,8,1\n")
    with pytest.raises(ExperimentError) as caught:
        made.run(show=Told())
    assert str(caught.value).startswith(
        "input 'keys': keys.csv, lines 2 and 4 to 5: robot/sim/command would not take "
        "what is there, such as: robot/sim/command (woodbot.command): 'wheel/left' "
        "expects a number in rad/s from -7.3 to 7.3, but got 9.0."
    )
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([3], "3"),
        ([2, 4, 5, 6], "2 and 4 to 6"),
        ([1, 3, 5], "1, 3 and 5"),
        (range(1, 40, 2), "1, 3, 5, 7, 9, 11 and 14 more"),
    ],
)
def test_lines_in_words(lines: list[int], words: str) -> None:
    assert shown(lines) == words


class Notes(Output):
    """Writes a file, and does not say so."""

    state = In(source="robot/sim/state")

    def open(self) -> None:
        (self.out / "notes.txt").write_text("it began")
        (self.out / "more").mkdir()

    def write(self, tick: Tick) -> None:
        """Write no more."""


def test_files_that_no_output_names_are_found(tmp_path: Path) -> None:
    for name in ("mine.txt", "sim.txt"):
        (tmp_path / name).write_text("of before")
        os.utime(tmp_path / name, (1e9, 1e9))
    made = Experiment("lab", duration=0.2)
    made.robot("sim", "woodbot", "kinematic")
    made.output("notes", Notes)
    made.output("log", "csv")
    result = made.run(tmp_path, direct=True, show=Told())
    assert result.files == [tmp_path / "sim.csv", tmp_path / "run.mcap"]
    assert result.others == [tmp_path / "more", tmp_path / "notes.txt"]


class Failing(Output):
    """Writes a file that it did not announce, and fails."""

    robots = In(source="robot/*/*")

    def write(self, tick: Tick) -> None:
        (self.out / "early.txt").write_text("1", encoding="utf-8")
        raise ValueError("no more")


def test_a_run_that_failed_lists_what_was_written(here: Path) -> None:
    made = lab()
    made.plans["output/log"].classes[0] = Failing
    (here / "out").mkdir()
    (here / "out" / "mine.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(AgentError):
        made.run("out", show=Show(), direct=True)
    about = json.loads((here / "out" / "run.json").read_text(encoding="utf-8"))
    written = [name for name in names(here / "out") if name.endswith((".txt", "mcap"))]
    assert about["files"] == [name for name in written if name != "mine.txt"]
    assert "early.txt" in about["files"]

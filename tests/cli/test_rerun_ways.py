"""`rems rerun --only` and `--fabric`; inputs that play a recording."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.experiment.again.replayed import replayed
from rems_net.agents.experiment.file import load
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.plan import HERE
from rems_net.recordings.mcap.reader import McapFile
from tests.agents.runs import in_one_host
from tests.cli.recorded import AGENTS, SAME, recorded
from tests.commands import ROOT, inside

EXAMPLES = ROOT / "examples"
#: a robot that is put back half-way, by a process; `{...}` is changed
REFEREE = """
from rems_net import Experiment, In, Process, Tick, Verbs
from rems_net.robots.epuck import Epuck


class Referee(Process):
    car = In(Epuck.state)
    verbs = Verbs(car)

    def step(self, tick):
        if tick.n == 20:
            self.verbs.reset()
"""


def ways(folder: Path) -> Experiment:
    """Noise, a world, `every`, `since`, and a verb called half-way."""
    (folder / "again_referee.py").write_text(REFEREE, encoding="utf-8")
    shutil.copy(EXAMPLES / "keys.csv", folder)
    lab = Experiment("ways", dt="50 ms", duration="2 s", seed=3, folder=folder)
    lab.input("keys", "csv", options={"file": "keys.csv"})
    lab.world("arena", options={"radius": "1 m"})
    wheels: dict[str, Any] = {"command": "input/keys", "options": {"noise": True}}
    for name, x in (("a", 0.3), ("b", 0.0)):
        lab.robot(
            name,
            "epuck",
            "kinematic",
            initial={"x": x},
            world="arena",
            every=2,
            **wheels,
        )
    lab.robot("late", "epuck", "kinematic", since=0.5, **wheels)
    lab.process("referee", "again_referee.py:Referee", car="robot/late/state")
    return lab


@pytest.mark.parametrize("words", [(), ("--fabric",), ("--only", "robot/late")])
def test_noise_a_world_every_since_and_a_verb(
    tmp_path: Path, words: tuple[str, ...]
) -> None:
    path = recorded(ways(tmp_path), tmp_path / "run")
    states = [m["robot/late/state"] for n, m in McapFile(path).ticks() if 18 < n < 23]
    assert len(set(states)) > 2
    done = inside("rerun", str(path), *words, folder=tmp_path)
    assert (done.returncode, SAME in done.stdout) == (0, True), done
    verdict = "played" if "--only" in words else "recomputed"
    assert f"process/referee  {verdict}  no difference" in done.stdout
    assert "robot/late       recomputed  no difference" in done.stdout


def test_one_agent_alone_against_its_recorded_ins(three: Path) -> None:
    """A robot that has changed does not change what the process reads."""
    text = AGENTS.replace("default=0.25", "default=0.5").replace("0.5 * self", "self")
    (three / "again_lab.py").write_text(text, encoding="utf-8")
    alone = inside("rerun", "run", "--only", "process/watch", folder=three)
    assert alone.returncode == 1
    assert "process/watch  recomputed  differs from tick 1 (0.05 s)" in alone.stdout
    assert "robot/sled     played  no difference" in alone.stdout
    (three / "again_lab.py").write_text(
        AGENTS.replace("default=0.25", "default=0.5"), encoding="utf-8"
    )
    same = inside("rerun", "run", "--only", "process/watch", folder=three)
    assert (same.returncode, SAME in same.stdout) == (0, True), same
    unknown = inside("rerun", "run", "--only", "process/w", folder=three)
    assert "there is no agent 'process/w' in again" in unknown.stderr


def test_how_far_apart_a_robot_is_now(tmp_path: Path) -> None:
    path = recorded(ways(tmp_path), tmp_path / "run")
    done = inside("rerun", str(path), "--set", "robot/late.x=20 mm", folder=tmp_path)
    (line,) = [
        row for row in done.stdout.splitlines() if row.startswith("robot/late, ")
    ]
    assert line.startswith("robot/late, recorded - now: 20.00 mm apart (rms), 20.00 mm")


def test_an_input_that_plays_a_recording_gives_the_same_bytes(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(EXAMPLES, tmp_path / "examples"))
    first = recorded(load(folder / "lab.toml"), tmp_path / "a")
    made = McapFile(first)
    lab = load(folder / "lab.toml")
    for key in [key for key in lab.plans if key.startswith("input/")]:
        del lab.plans[key]
        lab.input(key.partition("/")[2], "replay", options={"file": str(first)})
    again = McapFile(recorded(lab, tmp_path / "b"))
    assert [*again.ticks()] == [*made.ticks()]


def by_hand(lab: Experiment, folder: Path) -> McapFile:
    """A recording of a person who pushes the stick between ticks."""
    lab.robot("car", "pioneer3dx", "kinematic", command="input/hand")
    lab.output("rec", "mcap")
    with lab.engine(folder) as engine:
        for n in range(40):
            if n % 7 == 3:
                engine.put("input/hand/command", {"ahead": 5 * (n % 11) - 20})
            engine.step()
    return McapFile(folder / "run.mcap")


def test_a_person_plays_the_recording(tmp_path: Path) -> None:
    lab = Experiment("hand", dt="50 ms", duration="2 s", pace=1.0)
    lab.input("hand", "hand")
    file = by_hand(lab, tmp_path / "run")
    values = [m["robot/car/command"] for _, m in file.ticks()]
    assert len(set(values)) > 4
    for words in ((), ("--fabric",)):
        done = inside("rerun", "run", *words, folder=tmp_path)
        assert (done.returncode, SAME in done.stdout) == (0, True), done
        assert "input/hand  played  no difference" in done.stdout
        assert "robot/car   recomputed  no difference" in done.stdout
    again = Experiment("hand", dt="50 ms", duration="2 s")
    again.input("hand", "replay", options={"file": str(tmp_path / "run")})
    again.robot("car", "pioneer3dx", "kinematic", command="input/hand")
    again.output("rec", "mcap")
    with again.engine(tmp_path / "again") as engine:
        engine.step(40)
    assert [*McapFile(tmp_path / "again" / "run.mcap").ticks()] == [*file.ticks()]


def test_a_replay_on_a_fabric(tmp_path: Path) -> None:
    """All its keys have their recorded values; no class of it is needed."""
    made = recorded(ways(tmp_path), tmp_path / "run")
    (tmp_path / "again_referee.py").unlink()
    lab, left_out = replayed(made)
    assert left_out == []
    lab.output("rec", "mcap")
    in_one_host(lab, HERE).run(tmp_path / "b", pace="fast", show=Show())
    old = {(n, k): v for n, m in McapFile(made).ticks() for k, v in m.items()}
    new = {(n, k): v for n, m in McapFile(tmp_path / "b/run.mcap").ticks()
           for k, v in m.items()}  # fmt: skip
    assert old.keys() <= new.keys()
    assert all(new[at] == value for at, value in old.items())


def test_replay_by_the_command(three: Path) -> None:
    done = inside("replay", "run", "--pace", "fast", folder=three)
    assert (done.returncode, done.stderr.count("Traceback")) == (0, 0), done
    assert "nothing commands" not in done.stdout + done.stderr
    assert not (three / "runs").exists()
    bad = inside("replay", "run", "--pace", "quick", folder=three)
    assert (bad.returncode, len(bad.stderr.splitlines())) == (2, 1), bad


REPLAYS = [
    ({}, "its file is not named"),
    ({"file": "nowhere.mcap"}, "there is no file"),
    ({"file": "run", "agent": "input/x"}, "run.mcap has no agent 'input/x'; it has"),
    ({"file": "run", "agent": "robot/sled"}, "has the ports command, sensors, state"),
]


@pytest.mark.parametrize(("options", "says"), REPLAYS)
def test_a_replay_of_nothing(three: Path, options: dict[str, str], says: str) -> None:
    lab = Experiment("replay", folder=three, duration="1 s")
    lab.input("wave", "replay", options=options)
    with pytest.raises(ValueError, match=says):
        lab.check()

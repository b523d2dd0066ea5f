"""`rems rerun` with changes in code, settings and classes; and bad input."""

import json
from pathlib import Path

import pytest

from rems_net import Experiment, Input, Out, Schema, Tick
from rems_net.defdict import number
from rems_net.recordings.mcap.reader import McapFile
from tests.cli.recorded import AGENTS, SAME, recorded
from tests.commands import inside

CHANGES = [
    ("tick.n % 4", "tick.n % 5", "input/wave", 4, "value/speed", "m/s"),
    ('state["x"] > 0.25', 'state["x"] > 0.125', "robot/sled", 6, "sensors/on", ""),
    ("tick.n > 10", "tick.n > 12", "process/watch", 11, "value/late", ""),
    ("2.0 - state", "2.0 + 1e-15 - state", "robot/sled", 1, "sensors/front", "m"),
]


@pytest.mark.parametrize(("old", "new", "agent", "tick", "field", "unit"), CHANGES)
def test_a_changed_line_is_named(
    three: Path, old: str, new: str, agent: str, tick: int, field: str, unit: str
) -> None:
    file = three / "again_lab.py"
    file.write_text(AGENTS.replace(old, new), encoding="utf-8")
    done = inside("rerun", "run", folder=three)
    assert done.returncode == 1
    lines = done.stdout.splitlines()
    assert lines[0] == "again_lab.py differs from the file of the recording."
    assert " ".join(lines[1].split()) == (
        f"{agent} recomputed differs from tick {tick} ({tick * 0.05:g} s) on"
    )
    at = next(i for i, line in enumerate(lines) if line.startswith(f"    {field}  "))
    assert lines[at].endswith(f" {unit}") or not unit
    assert lines[at + 1].startswith(f"        from tick {tick} on, in ")
    assert max(map(len, lines)) <= 80


def test_settings_classes_and_seeds(three: Path) -> None:
    """Differences come in the order in which they begin, with how much at most."""
    done = inside("rerun", "run", "--set", "robot/sled.drag=0.5", folder=three)
    lines = done.stdout.splitlines()
    assert done.returncode == 1
    assert lines[0] == "robot/sled     recomputed  differs from tick 1 (0.05 s) on"
    at = lines.index(next(line for line in lines if line.startswith("    state/x  ")))
    # 20 ticks of 50 ms with 0.25 m/s less.
    assert (
        lines[at + 1] == "        from tick 1 on, in 20 messages; at most 0.25 m apart"
    )
    assert any(line.startswith("process/watch  recomputed  differs") for line in lines)
    assert lines[-2] == "input/wave     recomputed  no difference"

    later = inside("rerun", "run", "--set", "robot/sled.x=1 m", folder=three)
    assert "at most 1 m apart" in later.stdout
    seed = inside("rerun", "run", "--seed", "6", folder=three)
    assert seed.stdout.startswith("process/watch  recomputed  differs from tick 1 ")
    assert "robot/sled     recomputed  no difference" in seed.stdout

    better = "from again_lab import Watch\n\n\nclass Better(Watch):\n    pass\n"
    (three / "again_better.py").write_text(better, encoding="utf-8")
    same = inside(
        "rerun",
        "run",
        "--replace",
        "process/watch=again_better.py:Better",
        folder=three,
    )
    assert (same.returncode, SAME in same.stdout) == (0, True), same
    rk4 = inside("rerun", "run", "--replace", "robot/sled=mujoco", folder=three)
    assert rk4.returncode == 2


BAD = [
    (["nowhere.mcap"], "there is no file nowhere.mcap."),
    (["again_lab.py"], "again_lab.py is no MCAP file"),
    (["run", "--set", "robot/led.drag=1"], "there is no agent 'robot/led'"),
    (["run", "--set", "robot/sled.dragg=1"], "robot/sled has no setting 'dragg'"),
    (["run", "--set", "robot/sled"], "NAME=VALUE, such as --set robot/sim.track"),
    (["run", "--set", "robot/sled.drag=many"], "drag"),
    (["run", "--replace", "process/w=x.py:Y"], "there is no agent 'process/w'"),
    (["run", "--replace", "process/watch=again_lab.py:None"], "has no class 'None'"),
    (["run", "--replace", "process/watch=again_lab.py:Wave"], "Wave is no process"),
    (["run", "--replace", "robot/sled=woodbot"], "not as in the recording"),
    (["run", "--seed", "-1"], "seed"),
]


@pytest.mark.parametrize(("words", "says"), BAD)
def test_bad_input_is_one_sentence(three: Path, words: list[str], says: str) -> None:
    done = inside("rerun", *words, folder=three)
    assert done.returncode == 2, done
    assert says in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert "Traceback" not in done.stderr


def test_files_without_an_end_an_experiment_or_values(three: Path) -> None:
    whole = (three / "run" / "run.mcap").read_bytes()
    first = whole.index(b"rems:experiment") + 15
    chunk = McapFile(three / "run" / "run.mcap").chunks[0].at
    path = three / "cut.mcap"
    path.write_bytes(whole[:-200])
    done = inside("rerun", "cut.mcap", folder=three)
    assert (done.returncode, SAME in done.stdout) == (0, True), done
    path.write_bytes(whole[:first])
    done = inside("rerun", "cut.mcap", folder=three)
    assert done.returncode == 2
    assert "has no experiment in it" in done.stderr
    path.write_bytes(whole[:chunk])
    done = inside("rerun", "cut.mcap", folder=three)
    assert done.returncode == 2
    assert "has no values in it" in done.stderr


def test_classes_of_no_file_are_refused(tmp_path: Path) -> None:
    class Here(Input):
        value = Out(Schema("again.here", {"x": number()}))

        def read(self, tick: Tick) -> dict[str, float]:
            return {"x": 1.0}

    lab = Experiment("local", duration="1 s")
    lab.input("here", Here)
    recorded(lab, tmp_path / "run")
    done = inside("rerun", "run", folder=tmp_path)
    assert done.returncode == 2
    assert "input/here cannot be made again in " in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_what_the_recording_says_depends_on_the_experiment_alone(three: Path) -> None:
    about = json.dumps(McapFile(three / "run" / "run.mcap").about())
    assert str(three) not in about
    assert "again_lab.py:Watch" in about

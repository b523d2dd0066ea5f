"""`rems rerun`: a recorded run is done again, and each difference is named."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment, Input, Out, Schema, Tick
from rems_net.agents import registry
from rems_net.agents.experiment.file import load
from rems_net.agents.experiment.show import Show
from rems_net.cli.script import run_script
from rems_net.defdict import number
from rems_net.recordings.mcap.reader import McapFile
from tests.agents.runs import in_one_host
from tests.agents.test_determinism import in_a_few
from tests.agents.test_determinism import lab as carts
from tests.commands import ROOT, inside, rems
from tests.drivers.physics.test_physics import needs

EXAMPLES = ROOT / "examples"
SAME = "are the same, to the bit."
#: examples without devices and physics, which take less than 3 s
CLOSED = [
    *("pid.py", "referee.py", "leader_follower.py", "swarm.py", "own_input.py"),
    *("own_process.py", "own_robot.py", "own_output.py", "lab.toml"),
]
#: three agents: an input, a robot with noise of its own, a process; `{...}` is changed
AGENTS = """
from rems_net import Definition, Experiment, In, Input, Out, Process, Schema, Settings
from rems_net.units import length, number, velocity

PUSH = Schema("again.push", {"speed": velocity()})


class Wave(Input):
    value = Out(PUSH)

    def read(self, tick):
        return {"speed": 0.5 + 0.125 * (tick.n % 4)}


class Sled(Definition):
    parameters = Settings(drag=number(default=0.25))
    command = In(PUSH)
    state = Out(Schema("again.state", {"x": length(), "y": length()}))
    sensors = Out(Schema("again.sensors", {"front": length(), "on": number()}))

    def derivative(self, state, command):
        return {"x": command["speed"] - self.parameters.drag, "y": 0.125}

    def measure(self, state, command):
        return {"front": 2.0 - state["x"], "on": float(state["x"] > 0.25)}


class Watch(Process):
    options = Settings(most=number(default=0.3))
    sled = In(Sled.state)
    value = Out(Schema("again.seen", {"gap": length(), "late": number()}))

    def step(self, tick):
        self.value = {
            "gap": self.options.most - self.sled.x + 0.5 * self.random.random(),
            "late": float(tick.n > 10),
        }


if __name__ == "__main__":
    lab = Experiment("again", dt="50 ms", duration="1 s", seed=5)
    lab.input("wave", Wave)
    lab.robot("sled", Sled, "kinematic", command="input/wave")
    lab.process("watch", Watch, sled="robot/sled/state")
    lab.output("rec", "mcap")
    lab.run()
"""


def recorded(lab: Experiment, folder: Path, *, direct: bool = True) -> Path:
    """Record an experiment in a folder; return its file."""
    if not any(
        cls.__name__ == "McapOutput" for p in lab.plans.values() for cls in p.classes
    ):
        lab.output("recorder", "mcap")
    lab.run(folder, direct=direct, show=Show())
    return folder / "run.mcap"


def scripted(path: Path, folder: Path) -> None:
    """Record the experiment that a script runs, in a folder."""

    def runner(lab: Experiment, *_: Any, **__: Any) -> None:
        with registry.running_by(None):
            recorded(lab, folder)
        raise registry.ScriptEnd

    with pytest.raises(registry.ScriptEnd):
        run_script(path, [], runner)


@pytest.fixture
def three(tmp_path: Path) -> Path:
    """A folder with a recording of three agents in `run`."""
    (tmp_path / "again_lab.py").write_text(AGENTS, encoding="utf-8")
    with pytest.MonkeyPatch.context() as now:
        now.chdir(tmp_path)
        scripted(Path("again_lab.py"), tmp_path / "run")
    return tmp_path


@pytest.mark.parametrize("name", CLOSED)
def test_an_example_is_the_same_again(tmp_path: Path, name: str) -> None:
    folder = Path(shutil.copytree(EXAMPLES, tmp_path / "examples"))
    with pytest.MonkeyPatch.context() as now:
        now.chdir(folder)
        if name.endswith(".toml"):
            recorded(load(Path(name)), tmp_path / "run")
        else:
            scripted(Path(name), tmp_path / "run")
    done = inside("rerun", str(tmp_path / "run"), folder=folder)
    assert SAME in done.stdout, done
    assert done.returncode == 0
    assert "differs" not in done.stdout


@pytest.mark.parametrize("spread", ["direct", "one host", "several"])
def test_wherever_it_was_recorded(tmp_path: Path, spread: str) -> None:
    lab = carts()
    lab.plans = {key: p for key, p in lab.plans.items() if p.kind != "output"}
    lab.robot("late", "parts.py:Cart", "parts.py:Euler", since=1.5, every=2)
    lab.output("recorder", "mcap")
    if spread == "several":
        in_a_few(lab)
    elif spread == "one host":
        in_one_host(lab)
    recorded(lab, tmp_path / "run", direct=spread == "direct")
    done = inside("rerun", str(tmp_path / "run"), folder=lab.folder)
    assert done.returncode == 0, done
    assert SAME in done.stdout


def test_a_world_and_noise(tmp_path: Path) -> None:
    lab = Experiment("places", dt="50 ms", duration="2 s", seed=3, folder=EXAMPLES)
    lab.input("keys", "csv", file="keys.csv")
    lab.world("arena", radius="1 m")
    for name, x in (("b", 0.0), ("a", 0.3)):
        lab.robot(
            name,
            "epuck",
            "kinematic",
            options={"noise": True},
            initial={"x": x},
            world="arena",
            every=2,
        )
    lab.robot("free", "woodbot", "kinematic", command="input/keys")
    recorded(lab, tmp_path / "run")
    done = inside("rerun", str(tmp_path / "run"), folder=EXAMPLES)
    assert done.returncode == 0, done
    other = inside("rerun", str(tmp_path / "run"), "--seed", "4", folder=EXAMPLES)
    assert other.returncode == 1
    assert "robot/a      recomputed  differs from tick" in other.stdout
    assert "robot/free   recomputed  no difference" in other.stdout


CHANGES = [
    ("0.5 + 0.125", "0.5 + 0.126", "input/wave", 1, "value/speed", "m/s"),
    ("tick.n % 4", "tick.n % 5", "input/wave", 4, "value/speed", "m/s"),
    ("default=0.25", "default=0.26", "robot/sled", 1, "state/x", "m"),
    ('"y": 0.125', '"y": 0.126', "robot/sled", 1, "state/y", "m"),
    ("2.0 - state", "2.5 - state", "robot/sled", 1, "sensors/front", "m"),
    ('state["x"] > 0.25', 'state["x"] > 0.125', "robot/sled", 6, "sensors/on", ""),
    ("default=0.3", "default=0.4", "process/watch", 1, "value/gap", "m"),
    ("0.5 * self", "0.6 * self", "process/watch", 1, "value/gap", "m"),
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
    (["run", "--set", "robot/sled"], "expected such as robot/sim.track"),
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


def test_a_class_that_is_gone(three: Path) -> None:
    text = AGENTS.replace("class Watch", "class Watches").replace(
        ", Watch,", ", Watches,"
    )
    (three / "again_lab.py").write_text(text, encoding="utf-8")
    done = inside("rerun", "run", folder=three)
    assert done.returncode == 2
    assert "process/watch cannot be made again in " in done.stderr
    assert "again_lab.py has no class 'Watch'" in done.stderr


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


def test_a_version_and_a_data_file_that_differ(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(EXAMPLES, tmp_path / "examples"))
    with pytest.MonkeyPatch.context() as now:
        now.chdir(folder)
        now.setattr("rems_net.__version__", "0.0.9")
        recorded(load(Path("lab.toml")), tmp_path / "run")
    rows = (folder / "keys.csv").read_text(encoding="utf-8")
    (folder / "keys.csv").write_text(rows + "\n", encoding="utf-8")
    done = inside("rerun", str(tmp_path / "run"), folder=folder)
    lines = done.stdout.splitlines()
    assert lines[0] == "keys.csv differs from the file of the recording."
    assert lines[1].startswith("rems_net is 0.1.0 here; the recording was made with")
    assert done.returncode == 0, done


def test_what_lives_in_wall_time_plays_its_recording(tmp_path: Path) -> None:
    """And what reads it is computed from what was recorded."""
    parts = ROOT / "tests" / "engine"
    lab = Experiment("free", dt=0.02, duration=0.6, folder=parts)
    lab.robot("a", "callers.py:Sled", "callers.py:Free", initial={"x": 0.3})
    recorded(lab, tmp_path / "run", direct=False)
    done = inside("rerun", str(tmp_path / "run"), folder=parts)
    assert "robot/a  played  no difference" in done.stdout, done
    assert done.returncode == 0
    refused = inside(
        "rerun", str(tmp_path / "run"), "--set", "robot/a.x=1", folder=parts
    )
    assert "robot/a plays its recording" in refused.stderr


def test_what_the_recording_says_depends_on_the_experiment_alone(three: Path) -> None:
    about = json.dumps(McapFile(three / "run" / "run.mcap").about())
    assert str(three) not in about
    assert "again_lab.py:Watch" in about


@needs("mujoco")
def test_physics_in_a_pinned_process(tmp_path: Path) -> None:
    shutil.copy(EXAMPLES / "keys.csv", tmp_path)
    text = (EXAMPLES / "lab.toml").read_text(encoding="utf-8")
    robots, _, _ = text.partition("[[output]]")
    text = robots.replace("kinematic", "mujoco").replace("5 s", "1 s")
    text = text.replace('options = { integrator = "rk4" }', "")
    lab = f'{text}[[output]]\nname = "rec"\ntype = "mcap"\n'
    (tmp_path / "lab.toml").write_text(lab, encoding="utf-8")
    done = rems(tmp_path, "run", "lab.toml", "--direct")
    assert done.returncode == 0, done
    again = rems(tmp_path, "rerun", "runs/lab")
    assert (again.returncode, again.stderr) == (0, ""), again
    assert SAME in again.stdout
    done = rems(tmp_path, "run", "lab.toml", "--direct", "--native")
    assert done.returncode == 0, done
    native = rems(tmp_path, "rerun", "runs/lab")
    if sys.platform == "linux":  # nowhere else can a process be pinned
        assert native.stdout.startswith("The recording was computed with Linux ")

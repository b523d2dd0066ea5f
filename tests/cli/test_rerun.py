"""`rems rerun`: a recorded run is done again, and each difference is named."""

import shutil
import sys
from pathlib import Path

import pytest

from rems_net import Experiment
from rems_net.agents.experiment.again.compared import compare
from rems_net.agents.experiment.again.rebuilt import rebuild
from rems_net.agents.experiment.file import load
from rems_net.defdict import cdr
from tests.agents.runs import in_one_host
from tests.agents.test_determinism import in_a_few, lab as carts
from tests.cli.recorded import SAME, recorded, scripted
from tests.commands import ROOT, inside, rems
from tests.drivers.physics.test_physics import needs

EXAMPLES = ROOT / "examples"
PARTS = ROOT / "tests" / "engine"
#: examples without devices and physics, which take less than 3 s
CLOSED = [
    *("pid.py", "referee.py", "leader_follower.py", "swarm.py", "own_input.py"),
    *("own_process.py", "own_robot.py", "own_output.py", "lab.toml", "reach.py"),
]


#: the others that are computed: as_in_the_paper has devices, which are emulated
LONG = [
    pytest.param("own_body.py", marks=[pytest.mark.slow, needs("mujoco")]),
    pytest.param("find_ball.py", marks=[pytest.mark.slow, needs("mujoco")]),
    pytest.param(
        "three_drivers.py",
        marks=[pytest.mark.slow, needs("mujoco"), needs("pybullet")],
    ),
]


@pytest.mark.parametrize("name", [*CLOSED, *LONG])
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


@needs("mujoco")
def test_physics_whose_verb_is_called_half_way(tmp_path: Path) -> None:
    lab = Experiment("thrown", dt="20 ms", duration="1 s", folder=EXAMPLES)
    lab.input("keys", "csv", options={"file": "keys.csv"})
    lab.robot("sim", "woodbot", "mujoco", command="input/keys", since=0.1)
    with lab.engine(tmp_path / "run") as engine:
        engine.step(30)
        engine["sim"].reset()
        engine.run()
    done = inside("rerun", str(tmp_path / "run"), folder=EXAMPLES)
    assert (done.returncode, SAME in done.stdout) == (0, True), done
    made = rebuild(tmp_path / "run" / "run.mcap", EXAMPLES)
    made.lab.plans["robot/sim"].again = ()
    assert min(one.tick for one in compare(made).found.values()) == 31


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
    lab = Experiment("free", dt=0.02, duration=1.0, pace=1.0, folder=PARTS)
    lab.robot("a", "callers.py:Sled", "callers.py:Free", initial={"x": 0.3})
    recorded(lab, tmp_path / "run", direct=False)
    done = inside("rerun", str(tmp_path / "run"), folder=PARTS)
    assert "robot/a  played  no difference" in done.stdout, done
    assert done.returncode == 0
    refused = inside(
        "rerun", str(tmp_path / "run"), "--set", "robot/a.x=1", folder=PARTS
    )
    assert "robot/a plays its recording" in refused.stderr


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
    words = "run", "lab.toml", "--direct", "--native"
    done = inside(*words, folder=tmp_path)
    assert done.returncode == 0, done
    native = rems(tmp_path, "rerun", "runs/lab")
    if sys.platform == "linux":  # nowhere else can a process be pinned
        assert native.stdout.startswith("The recording was computed with Linux ")


def test_readers_of_what_is_played_are_computed_from_it(tmp_path: Path) -> None:
    """From the recorded value of the same tick; nothing is written."""
    lab = Experiment("free", dt=0.02, duration=1.0, folder=PARTS)
    lab.robot("a", "callers.py:Geared", "callers.py:Free")
    lab.robot("b", "callers.py:Geared", "kinematic", initial={"x": 1.0})
    lab.process("far", "callers.py:Far", sled="robot/a/state")
    path = recorded(in_one_host(lab), tmp_path / "run", direct=False)
    before = path.read_bytes(), sorted(tmp_path.rglob("*"))
    made = rebuild(path, PARTS)
    made.replace("process/far", "callers.py:Farther")
    result = compare(made)
    assert result.agents == {
        "robot/a": "played",
        "robot/b": "recomputed",
        "process/far": "recomputed",
    }
    (one,) = result.found.values()
    ways = [
        m["robot/a/state"]
        for n, m in made.file.ticks()
        if n <= one.tick
        if "robot/a/state" in m
    ]
    decode = cdr(made.file.schemas["robot/a/state"]).decode
    x = decode(ways[-1])["x"] if ways else 0.0  # before the first recorded value
    assert (one.key, one.now) == ("process/far/value", 1000 * x)
    assert one.most is not None
    assert one.most > 10  # m: a thousand times the way of the sled
    assert (path.read_bytes(), sorted(tmp_path.rglob("*"))) == before

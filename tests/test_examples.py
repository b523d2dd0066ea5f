"""Every example is one idea in few lines, and does what it says."""

import csv
import re
import shutil
from collections.abc import Callable
from itertools import pairwise
from math import dist, hypot, remainder, tau
from pathlib import Path

import pytest

from rems_net import read
from rems_net.drivers.physics.pictures.painter import look_for_renderer
from rems_net.errors import MissingPartError
from rems_net.maths.numerics import environment
from tests.commands import ROOT, Done, drivers_of, needs, python, rems

EXAMPLES = ROOT / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
#: what needs a robot of an open fabric is run by tests/firmware/emulated/test_remote.py
#: and what drives devices, which are never twice the same, by tests/test_paper.py;
#: what draws pictures takes long, and is run once, below; so is what learns
APART = ('"remote"', "emulated", '"epuck_camera"', '"camera"', "rems_net.gym")
ALONE = [s for s in SCRIPTS if not any(w in s.read_text("utf-8") for w in APART)]
FILES = sorted(EXAMPLES.glob("*.toml"))


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A folder to run them in, as a user would have it."""
    return Path(shutil.copytree(EXAMPLES, tmp_path / "examples"))


def last(runs: Path, *fields: str) -> dict[str, list[float]]:
    """The last values of some fields of every robot that a run has left."""
    found = {}
    for path in runs.glob("*/*.csv"):
        with path.open(encoding="utf-8", newline="") as file:
            *_, row = csv.DictReader(file)
        if fields[0] in row:  # or it is of a world
            found[path.stem] = [float(row[field]) for field in fields]
    return found


def the_integral_wins_against_the_wind(runs: Path) -> None:
    found = last(runs, "state/x [m]")
    assert found["pd"] == pytest.approx([0.875])
    assert found["pid"] == pytest.approx([1.0], abs=0.01)


def the_follower_stays_behind(runs: Path) -> None:
    found = last(runs, "state/x [m]", "state/y [m]")
    assert 0.1 < dist(found["leader"], found["follower"]) < 0.2


def the_swarm_flies_together(runs: Path) -> None:
    found = last(runs, "state/x [m]", "state/y [m]", "state/heading [rad]")
    assert len(found) == 20
    middle = [sum(each) / 20 for each in zip(*found.values(), strict=True)][:2]
    assert max(dist(middle, at[:2]) for at in found.values()) < 0.4
    ways = [remainder(at[2] - found["b0"][2], tau) for at in found.values()]
    assert max(map(abs, ways)) < 0.2


def the_arm_ends_where_the_circle_does(runs: Path) -> None:
    from rems_net.robots.youbot import JOINTS, YoubotArm

    found = last(runs, *(f"state/{joint} [rad]" for joint in JOINTS))
    arm = YoubotArm("arm")
    arm.prepare()
    joints = dict(zip(JOINTS, found["arm"], strict=True))
    assert arm.fk(joints).position == pytest.approx([0.25, 0.0, 0.05], abs=0.01)


def the_racer_starts_again(runs: Path) -> None:
    found = last(runs, "state/x [m]", "state/y [m]")
    assert found["racer"][0] < 0.11
    assert 0.2 < found["racer"][1] < 0.4  # two times to the left


def the_network_predicts_better(runs: Path) -> None:
    """Another run than that in which it learned: the RMS distance is less than half."""
    at = {}
    for name in ("real", "alone", "corrected"):
        with (runs / "predict" / f"{name}.csv").open(encoding="utf-8") as file:
            rows = [*csv.DictReader(file)]
        at[name] = [(float(r["state/x [m]"]), float(r["state/y [m]"])) for r in rows]
    off = {
        name: sum(dist(*pair) ** 2 for pair in zip(at["real"], at[name], strict=True))
        for name in ("alone", "corrected")
    }
    assert off["corrected"] < 0.25 * off["alone"]


def the_filters_know_where_it_is(runs: Path) -> None:
    """At least ten times as well as the model that has no sensors."""
    recording = read(runs / "estimate")
    last = {
        name: [float(recording[name].plain(f"state/{field}")[-1]) for field in "xy"]
        for name in ("real", "model", "process/ekf", "process/ukf")
    }
    assert dist(last["real"], last["model"]) > 0.1
    for name in ("process/ekf", "process/ukf"):
        assert dist(last["real"], last[name]) < 0.01


#: example -> what else it does, seen in what it left
DOES: dict[str, Callable[[Path], None]] = {
    "pid": the_integral_wins_against_the_wind,
    "leader_follower": the_follower_stays_behind,
    "swarm": the_swarm_flies_together,
    "referee": the_racer_starts_again,
    "residual": the_network_predicts_better,
    "estimate": the_filters_know_where_it_is,
    "reach": the_arm_ends_where_the_circle_does,
}


def ended(done: Done) -> None:
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("path", ALONE, ids=lambda path: path.stem)
def test_script(copy: Path, tmp_path: Path, path: Path) -> None:
    """From whatever folder, where it should end; in many processes the same bytes.

    Those of its first second; tests/engine/test_law.py compares all, and takes longer.
    A run that only trains something has one process both times. Numerics are pinned.
    `rems run` would draw a picture, too: tests/cli/test_script.py types it, and others.
    """
    text = path.read_text(encoding="utf-8")
    needs(*drivers_of(text))
    begun = re.sub(r'duration="[\d.]+ s"', 'duration="1 s"', text)
    begun = begun.replace("lab.run().folder", "lab.run(direct=True).folder")
    assert begun != text
    for name, script in (
        ("a", text.replace(".run()", ".run(direct=True)")),
        ("b", begun),
    ):
        (tmp_path / name).mkdir()
        (copy / path.name).write_text(script, encoding="utf-8")
        ended(python(tmp_path / name, str(copy / path.name), **environment({})))
    made = sorted((tmp_path / "a" / "runs").glob("*/*.csv"))
    assert bool(made) == ('"csv")' in text)
    for one in made:
        assert len(one.read_text(encoding="utf-8").splitlines()) > 10
        again = tmp_path / "b" / one.relative_to(tmp_path / "a")
        assert one.read_bytes().startswith(again.read_bytes())
        assert again.read_bytes().count(b"\n") > 10
    if path.stem in DOES:
        DOES[path.stem](tmp_path / "a" / "runs")


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_one_idea(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 50
    assert lines[0].startswith('"""')


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_file(copy: Path, path: Path) -> None:
    done = rems(copy, "run", "--direct", path.name, "--pace", "fast")
    assert (done.returncode, done.stderr) == (0, "")
    assert (copy / "runs" / path.stem).is_dir()


def test_the_experiment_takes_fifteen_lines(copy: Path) -> None:
    """The experiment of a file takes no more in Python."""
    script = (copy / "three_drivers.py").read_text().splitlines()
    assert len([line for line in script if line.strip()]) <= 15


def test_the_ball_is_found(copy: Path) -> None:
    try:
        look_for_renderer()
    except MissingPartError as error:
        pytest.skip(str(error))
    done = rems(copy, "run", "--direct", "find_ball.py")
    assert done.returncode == 0, done.stderr
    found = last(copy / "runs", "state/x [m]", "state/y [m]")
    assert dist(found["bot"], (0.4, 0.2)) < 0.2
    (album,) = copy.glob("runs/find_ball/bot.camera")
    assert [path.name for path in sorted(album.iterdir())][-1] == "000080.png"


@pytest.mark.slow
def test_ten_simulated_robots_and_an_emulated_one_follow_each_other(copy: Path) -> None:
    """It takes as long as it says; the emulated one drives in the fifth place."""
    pytest.importorskip("websockets", reason="websockets is not installed")
    done = python(copy, "ghost.py")
    assert done.returncode == 0, done.stderr
    assert "is inside" not in done.stdout + done.stderr
    found = last(copy / "runs", "state/x [m]", "state/y [m]")
    assert len(found) == 11
    names = [f"w{i}" for i in range(11)]
    for one, other in pairwise(names):
        assert 0.08 < dist(found[one], found[other]) < 0.4, (one, other)
    for x, y in found.values():
        assert hypot(x, y) == pytest.approx(0.8, abs=0.1)


@pytest.mark.parametrize(
    ("rounds", "near"),
    [(2, 1.0), pytest.param(12, 0.03, marks=pytest.mark.slow)],
)
def test_a_policy_is_trained(copy: Path, rounds: int, near: float) -> None:
    """All of it ends at the goal, in three places; the start of it only ends."""
    needs("gymnasium", "mujoco", "matplotlib")
    text = (copy / "train.py").read_text(encoding="utf-8")
    shorter = text.replace("24, 12", f"24, {rounds}")
    assert shorter != text or rounds == 12
    (copy / "train.py").write_text(shorter, encoding="utf-8")
    done = python(copy, "train.py")
    ended(done)
    found = re.findall(r"(\w+): ([\d.]+) m from the goal", done.stdout)
    assert [name for name, _ in found] == ["kinematic", "mujoco", "fabric"]
    assert max(float(away) for _, away in found) < near
    assert found[1][1] == found[2][1]  # MuJoCo here, and on a fabric
    assert (copy / "paths.png").stat().st_size > 5_000


def test_a_robot_drives_to_a_point_by_its_marker(copy: Path) -> None:
    pytest.importorskip("apriltag")
    try:
        look_for_renderer()
    except MissingPartError as error:
        pytest.skip(str(error))
    done = rems(copy, "run", "--direct", "by_eye.py")
    assert done.returncode == 0, done.stderr
    found = last(copy / "runs", "state/x [m]", "state/y [m]")
    assert dist(found["bot"], (0.2, 0.15)) < 0.02

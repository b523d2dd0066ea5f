"""`rems new robot NAME --from FILE`: a definition of the robot in a file."""

import csv
import sys
from pathlib import Path

import pytest

from rems_net import Experiment
from rems_net.agents.registry import load_file
from rems_net.cli import main
from rems_net.testing import check_robot
from tests.bodies.files.robots import ARM, CART, LIMB, arm, written
from tests.commands import Run, finished
from tests.drivers.physics.test_physics import needs


@needs("mujoco")
def test_what_it_writes_runs_at_once(folder: Path, rems: Run) -> None:
    """And goes where it is told; it does what a robot must."""
    arm(folder)
    made = rems("new", "robot", "my_lever", "--from", "arm/urdf/arm.urdf")
    assert (made.returncode, made.stderr) == (0, "")
    done = rems("run", "my_lever.py")
    assert (done.returncode, done.stderr) == (0, "")
    with (folder / "runs" / "my_lever" / "robot.csv").open() as file:
        rows = list(csv.DictReader(file))
    there = {path: float(value) for path, value in rows[len(rows) // 3].items()}
    assert there["state/shoulder [rad]"] == pytest.approx(0.5, abs=0.01)
    assert there["state/elbow [rad]"] == pytest.approx(0.5, abs=0.01)
    assert there["state/left [m]"] == pytest.approx(0.025, abs=0.001)
    check_robot("my_lever.py:MyLever", "mujoco", alone=True, only=("drives", "agrees"))


@needs("mujoco")
def test_what_it_writes_is_in_order(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With what the file says, in units, and what is a guess, which is said."""
    said = 'effort="20" velocity="2"'
    written(folder, "weak.urdf", arm(folder, ARM.replace(said, "")).read_text())
    (folder / "weak.urdf").rename(folder / "arm" / "urdf" / "weak.urdf")
    written(folder, "cart.urdf", CART)
    written(folder, "limb.xml", LIMB)
    for file in ("arm/urdf/weak.urdf", "cart.urdf", "limb.xml"):
        name = f"my_{Path(file).stem}"
        assert main(["new", "robot", name, "--from", file]) == 0
    weak, cart, limb = capsys.readouterr().out.split("Wrote ")[1:]
    assert "  it is bolted down\n  effort of: shoulder\n  speed of: sho" in weak
    assert "  it stands on the floor\n  wheels: left, right\n  what slips: c" in cart
    assert "  speed of: shoulder, elbow\nLook at that. Now type:" in limb
    assert "bolted" not in limb  # of an MJCF that is no guess
    text = {p.stem: p.read_text(encoding="utf-8") for p in folder.glob("my_*.py")}
    assert '"shoulder": angle(range=(-1.2, 1.5)),' in text["my_weak"]
    assert '"left": length(range=(0, 0.05)),' in text["my_weak"]
    assert text["my_weak"].count("# a guess: the file has none") == 1
    assert '"right"' not in text["my_weak"]  # it follows the left one
    assert '"left": angular_velocity(range=(-20, 20)),' in text["my_cart"]
    assert 'return Model(FILE, joints, friction={"caster": 0.0})' in text["my_cart"]
    assert '"shoulder": angle(range=(-1.0471, 1.5707)),' in text["my_limb"]
    rules = ["--isolated", "--line-length", "88", *map(str, folder.glob("my_*.py"))]
    for words in (["check", "--select", "E,F,I,N,B,UP,SIM"], ["format", "--diff"]):
        command = [sys.executable, "-m", "ruff", *words, *rules]
        done = finished(command)
        assert done.returncode == 0, done.stdout


@needs("mujoco")
def test_what_an_mjcf_says_of_its_servos(folder: Path) -> None:
    """It is what the draft begins with; how fast joints go can be set in a run."""
    own = 'kp="50" kv="2" ctrlrange="-0.5 1" gear="2" forcerange="-5 5"'
    text = LIMB.replace('kp="5" forcerange="-5 5"', own)
    turned = '<velocity joint="shoulder" kv="3" ctrlrange="-4 4"/>'
    text = text.replace('<motor joint="shoulder" gear="10" ctrlrange="-2 2"/>', turned)
    written(folder, "served.xml", text)
    assert main(["new", "robot", "my_served", "--from", "served.xml"]) == 0
    made = (folder / "my_served.py").read_text(encoding="utf-8")
    for line in (
        '"elbow": angle(range=(-0.25, 0.5)),',
        '"shoulder": angular_velocity(default=4, range=(0.04, 4)),',
        '"elbow": angular_velocity(default=1, range=(0.01, 50)),',
        'servo=Servo(gain=25, speed=top["elbow"], share="speed"),',
    ):
        assert line in made
    served = load_file(folder / "my_served.py")  # it runs only as a script of its own
    lab = Experiment("served", dt="50 ms", duration="1 s")
    for name, speed in (("slow", 0.1), ("fast", 0.4)):
        told = {"top_speed": {"elbow": speed}}
        lab.robot(name, served.MyServed, "mujoco", parameters=told)
    with lab.engine() as engine:
        for _ in range(20):
            for name in ("slow", "fast"):
                engine.put(f"robot/{name}/command", {"elbow": 0.5, "speed": 1.0})
            engine.step()
        assert engine["slow"].state["elbow"] == pytest.approx(0.1, abs=0.01)
        assert engine["fast"].state["elbow"] == pytest.approx(0.4, abs=0.01)
    check_robot("my_served.py:MyServed", "mujoco", alone=True, only=("drives",))


def test_whatever_joints_are_called(folder: Path) -> None:
    """What is in anybody's file stays text, and each joint has a field."""
    names = ("shoulder", "a&quot;: 0}; print() #"), ("elbow", "a b"), ("left", "a_b")
    text = ARM
    for old, new in names:
        text = text.replace(f'"{old}"', f'"{new}"')
    # Windows has no such quotes in names.
    name = "my 'arm'.urdf" if sys.platform == "win32" else 'my "arm".urdf'
    file = arm(folder, text).rename(folder / name)
    packages = ["--packages", str(folder)]
    assert main(["new", "robot", "quoted", "--from", file.name, *packages]) == 0
    assert main(["check", "quoted.py"]) == 0
    made = (folder / "quoted.py").read_text(encoding="utf-8")
    for path in ("a_0_print_", "a_b", "a_b_joint"):
        assert f'"{path}": ' in made


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["input", "x", "--from", "a.urdf"], "type: rems new robot x --from a.urdf"),
        (["robot", "x", "--from", "a.urdf"], "a.urdf cannot be read: No such file"),
        (["robot", "x", "--from", "rod.urdf"], "rod.urdf has no joint that moves"),
    ],
)
def test_what_it_refuses(
    folder: Path, words: list[str], what: str, capsys: pytest.CaptureFixture[str]
) -> None:
    written(folder, "rod.urdf", '<robot><link name="rod"/></robot>')
    assert main(["new", *words]) != 0
    assert what in " ".join(capsys.readouterr().err.split())
    assert not (folder / "x.py").exists()

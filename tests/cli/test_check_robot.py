"""`rems check` and `rems check robots`, as a user types them."""

import json
import re
from pathlib import Path

from tests.commands import Run

MINE = """\
from rems_net import Definition, Driver, In, Out, Schema
from rems_net.defdict import length, velocity


class Cart(Definition):
    command = In(Schema("command", {"speed": velocity(range=(-1, 1))}))
    state = Out(Schema("state", {"x": length()}))

    def derivative(self, state, command):
        return {"x": command.speed}


class Hasty(Driver):
    def drive(self, command, dt):
        self.state.x += 0.1 * command.speed

    def sense(self):
        pass
"""


def test_a_robot_of_my_own(folder: Path, rems: Run) -> None:
    (folder / "mine.py").write_text(MINE)
    done = rems("check", "mine.py:Cart")
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[0] == "Cart done by Kinematic"
    assert lines[-1] == "It does what a robot must: 12 checks, nothing wrong."
    assert max(map(len, lines)) <= 80


def test_a_wrong_driver(folder: Path, rems: Run) -> None:
    (folder / "mine.py").write_text(MINE)
    done = rems("check", "mine.py:Cart", "mine.py:Hasty", "--alone")
    assert (done.returncode, done.stderr) == (1, "")
    assert "  drives    WRONG\n" in done.stdout
    came = "x changes by 0.5 in 10 steps, by 1 in 20; drive() never reads dt"
    assert f"    came      {came}\n" in done.stdout
    assert "    where     Hasty.drive (mine.py, line 14)\n" in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 80
    told = json.loads(
        rems("check", "mine.py:Cart", "mine.py:Hasty", "--alone", "--json").stdout
    )
    wrong = [one["name"] for one in told["checks"] if one["findings"]]
    assert not told["ok"]
    assert "drives" in wrong


def test_settings_are_those_of_a_file(rems: Run) -> None:
    told = ["options.noise=true", "options.physics_step=2ms", "parameters.track=0.1"]
    words = [word for one in told for word in ("--set", one)]
    done = rems("check", "woodbot", "mujoco", "--only", "opens", *words)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_driver_alone(folder: Path, program: Run) -> None:
    (folder / "mine.py").write_text(MINE)
    done = program("check", "mine.py:Hasty")
    assert done.returncode == 2
    assert "rems check woodbot mine.py:Hasty" in done.stderr


def test_matrix(rems: Run, program: Run) -> None:
    done = program("check", "robots", "woodbot", "kinematic")
    assert done.returncode == 0
    head, row, *_ = done.stdout.splitlines()
    assert head.split() == ["kinematic"]
    assert row.startswith("woodbot")
    assert re.search(r"% [\d.]+k?$", row)
    assert "!" not in row
    (cell,) = json.loads(
        rems("check", "robots", "woodbot", "kinematic", "--json").stdout
    )
    assert (cell["definition"], cell["driver"]) == ("woodbot", "kinematic")
    assert cell["agreement"]["error"] < cell["agreement"]["allowed"]
    assert cell["steps_per_second"] > 100

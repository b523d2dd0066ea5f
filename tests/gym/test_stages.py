"""The same environment on an engine and on a fabric: the same bits, the same files."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from rems_net.maths.numerics import environment
from tests.commands import ROOT, python

pytest.importorskip("gymnasium", reason="gymnasium is not installed")

#: driver, whether in a world, with noise, every, steps
CASES = {
    "kinematic": ("kinematic", False, False, 1),
    "kinematic world": ("kinematic", True, True, 2),
    "mujoco world": ("mujoco", True, True, 3),
}

PROGRAM = """
import sys
import numpy as np
import rems_net.gym
from rems_net import Experiment

driver, world, noise, every, steps, out, fabric = eval(sys.argv[1])
lab = Experiment("stages", dt="10 ms", seed=5)
more = {"options": {"noise": noise}, "every": every}
if world:
    ball = {"name": "ball", "x": 0.2, "radius": 0.02, "mass": 0.05}
    lab.world("w", options={"radius": 0.6, "balls": [ball]})
    more["world"] = "w"
if fabric == "here":
    more["host"] = "here"
if __name__ == "__main__":
    lab.robot("sim", "woodbot", driver, **more)
    env = rems_net.gym.make(
        lab, act="robot/sim/command", observe=["robot/sim/state", "robot/sim/sensors"],
        start={"robot/sim.x": "-10..0 cm", "robot/sim.heading": "-180..180 deg"},
        limit="100 s", normalise=True, fabric=bool(fabric), out=out)
    random, rows = np.random.default_rng(1), []
    for episode in range(2):
        rows.append(env.reset(seed=3 + episode)[0])
        for _ in range(steps // 2):
            rows.append(env.step(random.uniform(-1, 1, 2))[0])
    env.close()
    np.save(out + ".npy", np.array(rows))
"""


#: without a main guard: the host of the process imports the script for its class
UNGUARDED = """
import rems_net.gym
from rems_net import Experiment, In, Out, Process, Woodbot

print("read", flush=True)


class Same(Process):
    state = In(Woodbot.state, source="robot/sim/state")
    value = Out(Woodbot.state)

    def step(self, tick):
        self.value = {"x": self.state.x}


lab = Experiment("unguarded", dt="50 ms", duration="1 s", record=False)
lab.robot("sim", "woodbot", "kinematic", host="here")
lab.process("same", Same)
env = rems_net.gym.make(
    lab, act="robot/sim/command", observe="process/same/value", fabric=True)
env.reset(seed=1)
env.step([2.0, 2.0])
env.close()
"""


def test_a_script_without_a_guard_starts_one_fabric(tmp_path: Path) -> None:
    """Its host started a fabric of its own, which the folder's lock refused."""
    (tmp_path / "lab.py").write_text(UNGUARDED)
    done = python(tmp_path, "lab.py")
    assert (done.returncode, done.stdout) == (0, "read\n"), done.stderr


def holds(folder: Path, name: str, steps: int, *fabrics: bool | str) -> None:
    """Check that all stages give the same observations, and the same recording."""
    if "mujoco" in name:
        pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    program = folder / "stages.py"
    program.write_text(PROGRAM)
    found = []
    pinned = environment({**os.environ, "PYTHONPATH": str(ROOT)})
    for fabric in (False, *fabrics):
        out = f"out{fabric}"
        words = repr((*CASES[name], steps, out, fabric))
        done = subprocess.run(
            [sys.executable, program.name, words],
            cwd=folder,
            env=pinned,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        recorded = (folder / out / "run.mcap").read_bytes()
        rows = (folder / f"{out}.npy").read_bytes()
        found.append((rows, hashlib.sha256(recorded).hexdigest()))
    assert all(one == found[0] for one in found)


@pytest.mark.parametrize(
    ("name", "fabric"), [("mujoco world", True), ("kinematic", "here")]
)
def test_the_same_bits_on_an_engine_and_on_a_fabric(
    tmp_path: Path, name: str, fabric: bool | str
) -> None:
    holds(tmp_path, name, 40, fabric)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_of_a_thousand_random_actions(tmp_path: Path, name: str) -> None:
    holds(tmp_path, name, 1000, True, *() if CASES[name][1] else ("here",))

"""Random numbers of an experiment: its seed, and what the seed does not set."""

import json
from pathlib import Path
from random import Random

import numpy as np
import pytest

from rems_net import Experiment
from rems_net.errors import ExperimentError, SchemaError
from tests.agents.scripts import HAND, LAB, python, script
from tests.engine.callers import Referee

DRAWS = """
import random

import numpy


class Hand(Input):
    value = Out(VALUE)

    def open(self):
        self.rng = numpy.random.default_rng(self.random.getrandbits(64))

    def read(self, tick):
        return {"wheel/left": self.random.uniform(0, 50), "wheel/right": DRAWN}


"""


def lefts(folder: Path) -> list[float]:
    """What the left wheel was told, in percent of 7.3 rad/s."""
    _, *rows = (folder / "runs/lab/sim.csv").read_text().splitlines()
    return [float(row.split(",")[1]) / 0.073 for row in rows]


def text(drawn: str, seed: str = "") -> str:
    lab = LAB.replace('duration="1 s"', f'duration="1 s"{seed}')
    return HAND + DRAWS.replace("DRAWN", drawn) + lab + "lab.run(direct=True)\n"


def numbers(seed: int) -> list[float]:
    draws = Random(f"{seed} input/hand")
    draws.getrandbits(64)
    return [draws.uniform(0, 50) for _ in range(10)]


def test_the_seed_sets_them(tmp_path: Path) -> None:
    made = []
    for i, (told, seed) in enumerate([("", 0), ("", 0), (", seed=7", 7)]):
        folder = tmp_path / str(i)
        folder.mkdir()
        assert script(folder, text("self.rng.uniform(0, 50)", told)) == (0, "")
        assert lefts(folder) == pytest.approx(numbers(seed))
        assert json.loads((folder / "runs/lab/run.json").read_text())["seed"] == seed
        made.append((folder / "runs/lab/sim.csv").read_bytes())
    assert made[0] == made[1] != made[2]


def test_from_the_command_line_and_a_file(tmp_path: Path) -> None:
    (tmp_path / "hand.py").write_text(HAND + DRAWS.replace("DRAWN", "0"))
    (tmp_path / "lab.toml").write_text(FILE)
    run = ("-m", "rems_net", "run", "--direct", "lab.toml")
    for words, seed in ((), 5), (("--seed", "7"), 7):
        status, said = python(tmp_path, *run, *words)
        assert status == 0, said
        assert "warning" not in said
        assert lefts(tmp_path) == pytest.approx(numbers(seed))
    assert python(tmp_path, *run, "--seed", "-1") == (
        2,
        "rems: lab.toml: seed is -1; expected a whole number from 0 to 2**63 - 1. "
        "(R0408)\n",
    )


def test_a_seed_of_the_system_is_refused() -> None:
    agent = Referee("a")
    with pytest.raises(SchemaError, match=r"no run could be repeated; leave the line"):
        agent.random.seed()
    agent.random.seed(1)
    assert agent.random.random() == Random(1).random()


FILE = """
[experiment]
duration = "1 s"
seed = 5

[[input]]
name = "hand"
type = "hand.py:Hand"

[[robot]]
name = "sim"
definition = "woodbot"
driver = "kinematic"
command = "input/hand"

[[output]]
name = "log"
type = "csv"
"""


@pytest.mark.parametrize("wrong", [True, 1.5, "7", -1, 2**63])
def test_what_is_no_seed(wrong: int) -> None:
    with pytest.raises(ExperimentError, match=r"seed is .*; expected a whole number"):
        Experiment(seed=wrong)


@pytest.mark.parametrize(
    ("drawn", "told"),
    [
        ("random.uniform(0, 50)", ("random", "self.random")),
        (
            "float(numpy.random.uniform(0, 50))",
            (
                "numpy.random",
                "numpy.random.default_rng(self.random.getrandbits(64))",
            ),
        ),
    ],
)
def test_a_use_of_global_numbers_is_told_once(
    tmp_path: Path, drawn: str, told: tuple[str, str]
) -> None:
    run = text(drawn).replace("direct=True", "")
    assert script(tmp_path, run) == (
        0,
        f"[input/hand] warning: input/hand draws from the global {told[0]}, which the "
        f"experiment's seed does not set; use {told[1]} (docs/agents.md)\n",
    )


def test_what_the_script_draws_is_its_own_affair(tmp_path: Path) -> None:
    start = "\n\nstart = random.random() + numpy.random.rand()\nlab ="
    assert script(tmp_path, text("0").replace("\nlab =", start)) == (0, "")
    assert len(set(np.round(lefts(tmp_path), 6))) == 10

"""Several robots at once, as PettingZoo has them."""

from __future__ import annotations

import warnings
from typing import Any

import pytest

pytest.importorskip("gymnasium", reason="gymnasium is not installed")
zoo = pytest.importorskip("pettingzoo.test", reason="PettingZoo is not installed")

import rems_net.gym  # noqa: E402
from rems_net import Experiment  # noqa: E402
from rems_net.errors import ExperimentError  # noqa: E402
from tests.gym.labs import ROBOTS  # noqa: E402


def pair(definition: str = "woodbot", **more: Any) -> Any:
    """Return an environment of two such robots."""
    lab = Experiment("pair", dt="50 ms")
    for name, y in (("a", 0.0), ("b", 0.2)):
        initial = {"y": y} if definition == "woodbot" else {}
        lab.robot(name, definition, "kinematic", initial=initial)
    has = lab.check()["robot/a"].published()
    looks = [port for port in has if port != "command"]
    usual: dict[str, Any] = {
        "act": {name: f"robot/{name}/command" for name in "ab"},
        "observe": {name: [f"robot/{name}/{p}" for p in looks] for name in "ab"},
        "limit": "1 s",
    }
    return rems_net.gym.make_parallel(lab, **{**usual, **more})


@pytest.mark.parametrize("robot", [r for r in ROBOTS if r != "epuck_camera"])
def test_pettingzoo_accepts_every_robot_of_the_house(robot: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        zoo.parallel_api_test(pair(robot), num_cycles=10)


def test_seeds_and_ends() -> None:
    def env() -> Any:
        return pair(
            reward={"a": "x", "b": "-x"},
            ends={"a": "x > 2 cm"},
            start={"robot/a.heading": "-5..5 deg"},
        )

    zoo.parallel_seed_test(env, num_cycles=10)
    one = env()
    one.reset(seed=1)
    full = {"a": [7.0, 7.0], "b": [7.0, 7.0]}
    while "a" in one.agents:
        _, rewards, ended, _, _ = one.step({k: full[k] for k in one.agents})
    assert ended == {"a": True, "b": False}
    assert rewards["a"] > 0.02
    assert rewards["b"] < -0.02
    with pytest.raises(ExperimentError, match="expected one of each of b"):
        one.step(full)

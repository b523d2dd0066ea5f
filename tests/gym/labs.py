"""Experiments that tests make environments of."""

from __future__ import annotations

from typing import Any

import rems_net.gym
from rems_net import Experiment
from rems_net.agents.registry import BUILT_IN

#: a camera alone has no command
ROBOTS = [one for one in BUILT_IN["definition"] if one != "camera"]
COMMAND, STATE, SENSORS = (
    f"robot/sim/{one}" for one in ("command", "state", "sensors")
)


def alone(definition: str = "woodbot", driver: Any = "kinematic", **more: Any) -> Any:
    """Return an experiment with one robot, `robot/sim`, with ticks of 10 ms."""
    lab = Experiment("lab", dt="10 ms", seed=5)
    lab.robot("sim", definition, driver, **more)
    return lab


def made(lab: Experiment, **more: Any) -> Any:
    """Return an environment of `robot/sim` with all that it publishes."""
    has = lab.check()["robot/sim"].published()
    looks = [f"robot/sim/{port}" for port in has if port != "command"]
    usual: dict[str, Any] = {"act": COMMAND, "observe": looks, "limit": "1 s"}
    return rems_net.gym.make(lab, **{**usual, **more})

"""Microseconds of one call: of sines, and of a step of robots. `native` or `pinned`."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
import timeit
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from rems_net import maths
from rems_net.agents.robot import Robot, combine
from rems_net.agents.tick import Tick
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.maths.numerics import environment
from rems_net.robots.woodbot import Woodbot

FUNCTIONS = {"sin": "sin", "atan2": "arctan2", "hypot": "hypot", "exp": "exp"}
SIZE = 1000


def best(call: Callable[[], object], number: int, repeats: int = 25) -> float:
    """Of the processor's own time: others may use it, too."""
    found = timeit.repeat(call, timer=time.process_time, number=number, repeat=repeats)
    return min(found) / number * 1e6


def functions() -> dict[str, float]:
    """`sin` by whom, of a number and of an array."""
    found = {}
    x, array = 3.7, np.linspace(-50.0, 50.0, SIZE)
    for name, numpys in FUNCTIONS.items():
        count = 2 if name in ("atan2", "hypot") else 1
        number, numbers = (x,) * count, (array,) * count
        for by, function in {
            "maths": getattr(maths, name),
            "math": getattr(math, name),
            "numpy": getattr(np, numpys),
        }.items():
            found[f"{name} {by}"] = best(partial(function, *number), 2000)
            if by != "math":
                found[f"{name}s {by}"] = best(partial(function, *numbers), 20)
    found["sincoss maths"] = best(lambda: maths.sincos(array), 20)
    found["sincoss numpy"] = best(lambda: (np.sin(array), np.cos(array)), 20)
    return found


def robots(driver: type[Any], count: int) -> list[Robot]:
    made = [combine(Woodbot, driver)(f"r{i}") for i in range(count)]
    for robot in made:
        robot.prepare()
        robot.open()
        robot.command = {"wheel": {"left": 3.0, "right": 2.5}}
    return made


def steps() -> dict[str, float]:
    """One step of 0.1 s, and what agents may do with numpy."""
    tick = Tick(1, 0.1, 0.1)
    (one,) = robots(Kinematic, 1)
    swarm = Kinematic.swarm(robots(Kinematic, SIZE))
    assert swarm is not None
    array, matrix = np.linspace(-5.0, 5.0, SIZE), np.ones((200, 200))
    found = {
        "kinematic": best(lambda: one.step(tick), 200),
        "swarm": best(lambda: swarm(tick), 3),
        "exp": best(lambda: np.exp(array), 100),
        "matrices": best(lambda: matrix @ matrix, 3),
    }
    if find_spec("mujoco"):
        (simulated,) = robots(Mujoco, 1)
        found["mujoco"] = best(lambda: simulated.step(tick), 5)
    return found


if __name__ == "__main__":
    how = sys.argv[1]
    if how in ("native", "pinned"):  # the C library reads it as a process starts
        env = environment(os.environ, native=how == "native")
        command = [sys.executable, "-m", "benchmarks.programs.numerics", "steps"]
        sys.exit(subprocess.run(command, env=env, check=False).returncode)
    print(json.dumps(steps() if how == "steps" else functions()))

"""Many Woodbots in one MuJoCo world: as an experiment, and by bare mj_step.

python -m benchmarks.programs.worlds rems|bare ROBOTS TICKS STEPS

Both step the same model by some steps of 1 ms a tick, and every robot drives in a
circle of its own.
"""

from __future__ import annotations

import json
import sys
import time
from math import ceil, sqrt
from typing import Any

from benchmarks.parts import Circling
from benchmarks.programs.watching import Watcher, go
from rems_net import Experiment
from rems_net.drivers.physics.physics import Physics
from rems_net.libraries import load

TICKS = "clock/tick"
STEP = 0.001
#: between robots, m
APART = 0.3


def experiment(robots: int, ticks: int, steps: int) -> Experiment:
    """The experiment that both run."""
    dt = steps * STEP
    lab = Experiment("worlds", dt=dt, duration=ticks * dt, record=False)
    wide = ceil(sqrt(robots))
    lab.world("floor", options={"size": [APART * (wide + 2)] * 2})
    for i in range(robots):
        x, y = (APART * (n - (wide - 1) / 2) for n in divmod(i, wide))
        place = {"x": x, "y": y}
        lab.robot(f"r{i}", Circling, "mujoco", initial=place, world="floor")
    return lab


def rems(robots: int, ticks: int, steps: int) -> float:
    """Ticks per second of the experiment, every robot with all its sensors."""
    watcher = Watcher(TICKS)
    go(experiment(robots, ticks, steps), watcher)
    return watcher.tallies[TICKS].rate()


def bare(robots: int, ticks: int, steps: int) -> float:
    """Ticks per second of mj_step alone, in the world that the experiment opens."""
    mujoco = load("mujoco", "mujoco")
    agents = experiment(robots, ticks, steps).check()
    some: list[Any] = [agent for agent in agents.values() if isinstance(agent, Physics)]
    for robot in some:
        robot.open()
    some[0].shared.advance(STEP)  # the motors are told
    engine = some[0].member.instance
    model, data = engine._model, engine._data
    warm = max(1, ticks // 5)
    mujoco.mj_step(model, data, steps * warm)
    begun = time.perf_counter()
    for _ in range(ticks - warm):
        mujoco.mj_step(model, data, steps)
    return (ticks - warm) / (time.perf_counter() - begun)


def main() -> None:
    measure = {"rems": rems, "bare": bare}[sys.argv[1]]
    rate = measure(*map(int, sys.argv[2:]))
    print(json.dumps({"rate": rate}))


if __name__ == "__main__":
    main()

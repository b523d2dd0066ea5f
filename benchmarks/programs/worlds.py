"""Many Woodbots in one MuJoCo world: as an experiment, and by bare mj_step.

python -m benchmarks.programs.worlds rems|bare ROBOTS TICKS

Both step the same model by ten steps of 1 ms a tick, and every robot drives in a circle
of its own.
"""

from __future__ import annotations

import json
import sys
import time
from math import ceil, sqrt

from benchmarks.parts import Circle
from benchmarks.programs.watching import Watcher, go
from rems_net import Experiment
from rems_net.drivers.physics.physics import Physics

TICKS = "clock/tick"
DT = 0.01
#: between robots, m
APART = 0.3


def experiment(robots: int, ticks: int) -> Experiment:
    """The experiment that both run."""
    lab = Experiment("worlds", dt=DT, duration=ticks * DT)
    lab.input("circle", Circle)
    wide = ceil(sqrt(robots))
    lab.world("floor", size=[APART * (wide + 2)] * 2)
    for i in range(robots):
        x, y = (APART * (n - (wide - 1) / 2) for n in divmod(i, wide))
        place = {"x": x, "y": y}
        lab.robot(
            f"r{i}",
            "woodbot",
            "mujoco",
            command="input/circle",
            initial=place,
            world="floor",
        )
    return lab


def rems(robots: int, ticks: int) -> float:
    """Ticks per second of the experiment, every robot with all its sensors."""
    watcher = Watcher(TICKS)
    go(experiment(robots, ticks), watcher)
    return watcher.tallies[TICKS].rate()


def bare(robots: int, ticks: int) -> float:
    """Ticks per second of mj_step alone, in the world that the experiment opens."""
    import mujoco

    agents = experiment(robots, ticks).check()
    some = [agent for agent in agents.values() if isinstance(agent, Physics)]
    for robot in some:
        robot.open()
        robot.command = Circle.SPEEDS
    some[0].shared.advance(DT)  # the motors are told
    engine = some[0].member.instance
    model, data = engine._model, engine._data
    warm = max(1, ticks // 5)
    mujoco.mj_step(model, data, 10 * warm)
    begun = time.perf_counter()
    for _ in range(ticks - warm):
        mujoco.mj_step(model, data, 10)
    return (ticks - warm) / (time.perf_counter() - begun)


def main() -> None:
    which, robots, ticks = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    rate = rems(robots, ticks) if which == "rems" else bare(robots, ticks)
    print(json.dumps({"rate": rate}))


if __name__ == "__main__":
    main()

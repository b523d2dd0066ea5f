"""Digests of what kinematic robots compute: `python -m tests.maths.steps`.

Alone and as a swarm, by both integrators; in seconds under an emulated processor, too.
"""

import hashlib
import json
import sys
from collections.abc import Iterable

import numpy as np

from rems_net import maths
from rems_net.agents.robot import Robot, combine
from rems_net.agents.tick import Tick
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.kinematic.swarm import Swarm
from rems_net.maths.numerics import describe
from rems_net.robots.woodbot import Woodbot


def functions() -> str:
    """Of all of rems_net.maths, over numbers and arrays."""
    total = hashlib.sha256()
    for size in (30, 3000):  # one by one, and as arrays
        x = np.linspace(-700.0, 700.0, size)
        for name in ("sin", "cos", "tan", "exp"):
            total.update(getattr(maths, name)(x).astype("<f8").tobytes())
        total.update(maths.log(np.abs(x)).astype("<f8").tobytes())
        total.update(maths.atan2(x, 3.0).astype("<f8").tobytes())
        total.update(maths.hypot(x, 3.0).astype("<f8").tobytes())
    return total.hexdigest()[:12]


def robots(integrator: str, count: int) -> list[Kinematic]:
    made = []
    for i in range(count):
        initial = {"heading": 0.37 * i}
        kind = combine(Woodbot, Kinematic)
        robot = kind(f"r{i}", initial=initial, options={"integrator": integrator})
        assert isinstance(robot, Kinematic)
        robot.prepare()
        made.append(robot)
    return made


def command(robots: Iterable[Robot], n: int) -> None:
    for i, robot in enumerate(robots):
        left, right = 7 * maths.sin(i + 0.1 * n), 6 * maths.cos(0.2 * i * n)
        robot.command = {"wheel": {"left": left, "right": right}}


def alone(integrator: str) -> str:
    (robot,) = made = robots(integrator, 1)
    total = hashlib.sha256()
    for n in range(1, 200):
        command(made, n)
        robot.step(Tick(n, n / 10, 0.1))
        total.update(robot.state.encode() + robot.sensors.encode())
    return total.hexdigest()[:12]


def together(integrator: str) -> str:
    made = robots(integrator, 100)
    swarm = Swarm.of(made)
    assert swarm is not None
    total = hashlib.sha256()
    for n in range(1, 50):
        command(made, n)
        swarm.step(Tick(n, n / 10, 0.1))
        for robot in made:
            total.update(robot.state.encode() + robot.sensors.encode())
    return total.hexdigest()[:12]


def digests() -> dict[str, str]:
    found = {"functions": functions()}
    for integrator in ("euler", "rk4"):
        found[f"alone {integrator}"] = alone(integrator)
        found[f"together {integrator}"] = together(integrator)
    return found


if __name__ == "__main__":
    print(describe(), file=sys.stderr)
    print(json.dumps(digests()))

"""What tests of a correction share: a drive is learned from, another is predicted."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from rems_net import Tick, Woodbot
from rems_net.agents.robot import combine
from rems_net.drivers.kinematic.correction import Weights, go, limits
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.identification.drive import Drive, Floats
from rems_net.processes.residual import Residual
from tests.identification.test_identify import keys

POSE = ("x", "y", "heading")
#: Rows before a free run whose commands a correction may know.
MEMORY = 20
Parameters = dict[str, Any]
#: parameters of the class, on a floor without a wall
FOUND: Parameters = {"arena_radius": "0 m"}


def step_of(drive: Drive) -> float:
    return round(float(np.diff(drive.time).mean()), 4)


def robot(parameters: Parameters, weights: Path | None = None) -> Kinematic:
    """Return a kinematic Woodbot, without or with a correction."""
    options = {"correction": str(weights)} if weights else {}
    found = combine(Woodbot, Kinematic)("r", parameters=parameters, options=options)
    found.prepare()
    assert isinstance(found, Kinematic)
    return found


def learner(parameters: Parameters, **options: object) -> Residual:
    """Return a process as it is in a run, with the ports of a Woodbot."""
    words = ", ".join(f"{name} = {json.dumps(one)}" for name, one in parameters.items())
    given = {"definition": "woodbot", "parameters": words, **options}
    found, like = Residual("learner", options=given), robot(parameters)
    found.prepare()
    found.settle("command", like.command.schema)
    found.settle("state", like.state.schema)
    found.open()
    return found


def save(folder: Path, weights: Weights) -> Path:
    path = folder / "weights.json"
    weights.write(path)
    return path


def learned(drive: Drive, parameters: Parameters) -> Weights:
    """Return the weights after one pass over a drive."""
    process, dt = learner(parameters), step_of(drive)
    most = limits(process.model.command.schema)["wheel/left"]
    for n in range(len(drive)):
        process.command = {p: s[n] * most for p, s in drive.command.items()}
        process.state = {path: float(drive.state[path][n]) for path in POSE}
        process.step(Tick(n + 1, (n + 1) * dt, dt))
    return process.saved()


def free_run(
    drive: Drive, parameters: Parameters, weights: Path | None, first: int, rows: int
) -> Floats:
    """Return the poses (rows + 1, 3) of a free run from one row of a drive."""
    return _free(drive, robot(parameters, weights), first, rows)


def error(
    drive: Drive, parameters: Parameters, weights: Path | None, seconds: float
) -> float:
    """Return the RMS distance [m] after free runs of so many seconds."""
    dt = step_of(drive)
    model, rows = robot(parameters, weights), round(seconds / dt)
    off = []
    for first in range(0, len(drive) - rows, max(1, round(1 / dt))):
        last = _free(drive, model, first, rows)[-1]
        off.append([last[i] - drive.state[POSE[i]][first + rows] for i in (0, 1)])
    return float(np.sqrt((np.array(off) ** 2).sum(axis=1).mean()))


def _free(drive: Drive, model: Kinematic, first: int, rows: int) -> Floats:
    """Run from a row; a correction knows the commands before it."""
    dt = step_of(drive)
    most = limits(model.command.schema)["wheel/left"]
    commands = [
        {path: float(shares[n]) * most for path, shares in drive.command.items()}
        for n in range(max(0, first - MEMORY), first + rows + 1)
    ]
    model.rewind()
    for command in commands[: -rows or None]:
        go(model, command, dt)
    model.state = {path: float(drive.state[path][first]) for path in POSE}
    went = [[model.state[path] for path in POSE]]
    for command in commands[-rows:]:
        go(model, command, dt)
        went.append([model.state[path] for path in POSE])
    return np.array(went)


def late(
    seed: int, seconds: float, lag: float = 0.09, delay: int = 6, **more: str
) -> Drive:
    """Return the drive of a robot of another hand, every 0.1 s.

    Its wheels have a dead band of 4 % of full speed, and a left motor that is 6 %
    weaker. Readings have a noise of 0.5 mm and 0.2 degrees. lag: s.  delay: in 10 ms,
    at most 10.  more: its own parameters.
    """
    random, fine, rows = np.random.default_rng(seed), 0.01, round(seconds / 0.1)
    shares = np.stack([keys(random, rows), keys(random, rows)])
    told = np.repeat(np.pad(shares, ((0, 0), (1, 0))), 10, axis=1)
    told = told[:, 10 - delay : told.shape[1] - delay]
    told = np.where(np.abs(told) < 0.04, 0.0, told - 0.04 * np.sign(told))
    model, wheels = robot({"arena_radius": "0 m", **more}), np.zeros(2)
    most, poses = limits(model.command.schema)["wheel/left"], [[0.0] * 3]
    for n in range(10 * rows):
        wheels = wheels + (told[:, n] - wheels) * (1 - np.exp(-fine / lag))
        left, right = (wheels * (0.94, 1.0) * most).tolist()
        go(model, {"wheel": {"left": left, "right": right}}, fine)
        if n % 10 == 9:
            poses.append([model.state[path] for path in POSE])
    read = np.array(poses).T
    noise = np.array([[5e-4], [5e-4], [np.deg2rad(0.2)]])
    read += noise * random.normal(size=read.shape)
    command = np.pad(shares, ((0, 0), (1, 0)))
    return Drive(
        "late",
        np.arange(rows + 1, dtype=np.float64) * 0.1,
        {"wheel/left": command[0], "wheel/right": command[1]},
        dict(zip(POSE, read, strict=True)),
    )

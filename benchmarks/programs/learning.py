"""Microseconds of learning from a robot: an update of a network, and a fit.

`rems_net` or `bare`, which does the same sums in a plain loop of numpy.
"""

from __future__ import annotations

import json
import sys
import time
import timeit
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net import Woodbot
from rems_net.drivers.kinematic.correction import Network
from rems_net.identification.drive import Drive
from rems_net.identification.fit import fit
from rems_net.identification.prediction import Predictor, cut
from rems_net.processes.learner import Learner

Floats = NDArray[np.float64]
INPUTS, HIDDEN, RESULTS = 6, 5, 3
#: m, rad/s, m: of the Woodbot that drives
TRACK, TOP, RADIUS = 0.105, 6.9, 0.02
BEGIN = {"track": 0.1126, "max_wheel_speed": 7.3}
RANGES = {"track": (0.001, 1.0), "max_wheel_speed": (0.01, 100.0)}


def best(call: Callable[[], object], number: int) -> float:
    """Of the processor's own time, us: others may use it, too."""
    found = timeit.repeat(call, timer=time.process_time, number=number, repeat=15)
    return min(found) / number * 1e6


def network(weights: Floats, given: Floats) -> Floats:
    """The same network as `Network`, by products of matrices."""
    a, b, v, w = np.split(
        weights, np.cumsum([HIDDEN * INPUTS, HIDDEN, RESULTS * HIDDEN]).tolist(), axis=1
    )
    level = a.reshape(-1, HIDDEN, INPUTS) @ given + b
    lit = level / (1 + np.abs(level)) - b / (1 + np.abs(b))
    found: Floats = (v.reshape(-1, RESULTS, HIDDEN) @ lit[:, :, None])[:, :, 0]
    return found + w.reshape(-1, RESULTS, INPUTS) @ given


def update(mean: Floats, cov: Floats, given: Floats, read: Floats) -> Any:
    """An unscented Kalman filter, as textbooks write it."""
    n = len(mean)
    steps = np.sqrt(n) * np.linalg.cholesky(cov).T
    points = np.concatenate([mean + steps, mean - steps])
    values = network(points, given)
    middle = values.mean(axis=0)
    off, away = values - middle, points - mean
    s = off.T @ off / (2 * n) + 0.01 * np.eye(RESULTS)
    gain = away.T @ off / (2 * n) @ np.linalg.inv(s)
    return mean + gain @ (read - middle), cov - gain @ s @ gain.T


def drive() -> Drive:
    """10 s of a Woodbot, every 0.1 s."""
    random = np.random.default_rng(1)
    left, right = (np.repeat(random.uniform(-1, 1, 20), 5) for _ in "ab")
    poses = [np.array([0.0, 0.0, 0.0])]
    for one, two in zip(left, right, strict=True):
        poses.append(poses[-1] + rates(poses[-1], one, two, TRACK, TOP) * 0.1)
    read = np.array(poses).T + 1e-3 * random.normal(size=(3, 101))
    shares = {"wheel/left": np.r_[0.0, left], "wheel/right": np.r_[0.0, right]}
    state = dict(zip(("x", "y", "heading"), read, strict=True))
    return Drive("r", np.arange(101, dtype=np.float64) * 0.1, shares, state)


def rates(pose: Any, left: Any, right: Any, track: float, top: float) -> Floats:
    v, w = RADIUS * top * (left + right) / 2, RADIUS * top * (right - left) / track
    zero = 0 * pose[2]
    return np.array([v * np.cos(pose[2]), v * np.sin(pose[2]), w + zero])


def bare(given: Drive) -> list[float]:
    """Gauss and Newton's method over the same pieces, with free starts, 8 steps."""
    parts = cut([given], 2.0)
    read = np.array([*parts.read.values()])
    theta, starts = np.array([*BEGIN.values()]), read[:, :, 0].copy()

    def off(theta: Floats, starts: Floats) -> Floats:
        pose, found = starts, [starts]
        for i in range(parts.steps.shape[1]):
            left, right = (c[parts.rows[:, i]] for c in given.command.values())
            h = parts.steps[:, i]
            k = rates(pose, left, right, *theta)
            middle = rates(pose + k * h / 2, left, right, *theta)
            last = rates(pose + middle * h, left, right, *theta)
            pose = pose + (k + 4 * middle + last) * h / 6
            found.append(pose)
        rows = (np.array(found).transpose(1, 2, 0) - read) * parts.weight
        table: Floats = rows.transpose(1, 2, 0).reshape(read.shape[1], -1)
        return table

    for _ in range(8):
        r = off(theta, starts)
        slopes = [(off(theta + d, starts) - r) / 1e-5 for d in np.eye(2) * 1e-5]
        a = np.stack(slopes, axis=2)
        moved = [starts + 1e-5 * np.eye(3)[i][:, None] for i in range(3)]
        b = np.stack([(off(theta, one) - r) / 1e-5 for one in moved], axis=2)
        q, upper = np.linalg.qr(b)
        free = a - q @ (q.transpose(0, 2, 1) @ a)
        rest = r - (q @ (q.transpose(0, 2, 1) @ r[..., None]))[..., 0]
        step = np.linalg.lstsq(free.reshape(-1, 2), -rest.ravel(), rcond=None)[0]
        push = (r + a @ step)[..., None]
        starts -= np.linalg.solve(upper, q.transpose(0, 2, 1) @ push)[..., 0].T
        theta = theta + step
    return [float(one) for one in theta]


def main() -> None:
    random, given = np.random.default_rng(1), drive()
    inputs, read = random.uniform(-1, 1, INPUTS), random.normal(0, 0.1, RESULTS)
    learner = Learner(Network(INPUTS, HIDDEN), random)
    mean, cov = learner.mean.copy(), learner.root @ learner.root.T
    predictor = Predictor(Woodbot, {"arena_radius": 0})
    if sys.argv[1] == "bare":
        found = {
            "update": best(lambda: update(mean, cov, inputs, read), 50),
            "fit": best(lambda: bare(given), 2),
        }
    else:
        found = {
            "update": best(lambda: learner.learn(inputs, read), 50),
            "fit": best(lambda: fit(predictor, [given], BEGIN, RANGES), 1),
        }
    assert abs(bare(given)[0] - TRACK) < 0.002
    print(json.dumps(found))


if __name__ == "__main__":
    main()

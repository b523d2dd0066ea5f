"""Episodes: parts of the time in which two robots moved differently."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.parting.trajectory import NEAR, Array, StepTrajectory

Rows = NDArray[np.bool_]

#: fractions of the usual speed. A larger difference is another movement; a robot that
#: is slower stands.
DIFFERS, STANDS = 0.3, 0.02
#: s. Window of the compared speeds, and least duration of an episode.
WHILE = 0.1
#: fraction of the moving time. Episodes take at most so much if no robot is held.
PART = 0.4
#: fraction of the other robot's way in an episode. A robot that moves less is held.
HELD = 0.2


@dataclass(frozen=True)
class Episodes:
    """Steps in which two trajectories moved differently.

    rows (n,): True in these steps      share: of the time in which anything moved
    held: the robot that hardly moved in them: 0 the first, 1 the second; None for none
    standing (n,): steps in which the first robot stands
    """

    rows: Rows
    share: float
    held: int | None
    standing: Rows


def episodes(a: StepTrajectory, b: StepTrajectory) -> Episodes:
    """Find the episodes; none if the trajectories differ for most of the time."""
    size = _sizes(a)
    steps = [one.steps() * size / a.dt() for one in (a, b)]
    wide = max(1, min(len(steps[0]), round(WHILE / float(np.median(a.dt())))))
    speeds = [_smooth(one, wide) for one in steps]
    usual = max(float(np.sqrt(np.mean(np.square(one)))) for one in speeds)
    moving = np.maximum(*speeds) > STANDS * usual
    rows = _lasting(_smooth(steps[1] - steps[0], wide) > DIFFERS * usual, wide)
    share = float(rows.sum() / max(1, moving.sum()))
    gone = [float(one[rows].sum()) for one in speeds]
    slower = int(gone[1] < gone[0])
    held = slower if share and gone[slower] < HELD * gone[1 - slower] else None
    # A robot that is held all the time is just slower.
    if share > (PART if held is None else 1 - PART / 4):
        rows, share, held = np.zeros_like(rows), 0.0, None
    now = np.linalg.norm(steps[0], axis=1)
    return Episodes(rows, share, held, now <= STANDS * usual)


def _sizes(a: StepTrajectory) -> Array:
    """Return the weights of a step's parts (size,): a turn by its typical lever."""
    found = np.ones(a.size)
    if a.turns:
        sums = np.square(a.steps()).sum(axis=0)
        ways, turns = (float(sums[list(part)].sum()) for part in (a.ways, a.turns))
        most = float(a.weights()[-1])
        arm = float(np.sqrt(ways / turns)) if turns > 0 else most
        found[list(a.turns)] = min(max(arm, NEAR), most)
    return found


def _smooth(steps: Array, wide: int) -> Array:
    kernel = np.ones(wide) / wide
    parts = [np.convolve(part, kernel, "same") for part in steps.T]
    found: Array = np.linalg.norm(parts, axis=0)
    return found


def _lasting(rows: Rows, least: int) -> Rows:
    """Return the rows of episodes that last long enough."""
    edges = np.flatnonzero(np.diff(np.r_[0, rows, 0]))
    found = np.zeros_like(rows)
    for begin, end in edges.reshape(-1, 2):
        found[begin:end] = end - begin > least
    return found

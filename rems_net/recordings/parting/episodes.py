"""Episodes: when two robots moved otherwise, where that is a part of the time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.parting.course import NEAR, Array, Course

Rows = NDArray[np.bool_]

#: of the usual speed: who differs by so much moves otherwise; who is slower stands
DIFFERS, STANDS = 0.3, 0.02
#: s: over so long speeds are compared, and so long lasts an episode at least
WHILE = 0.1
#: of the time that anything moves: episodes take no more, unless somebody is held
PART = 0.4
#: of the way of the other one, during an episode: who goes less is held
HELD = 0.2


@dataclass(frozen=True)
class Episodes:
    """Steps in which two courses went on otherwise.

    rows (n,): which      share: of the time that anything moved
    held: who hardly moved in these, 0 for the first, 1 for the second; None for nobody
    standing (n,): steps in which the first stands
    """

    rows: Rows
    share: float
    held: int | None
    standing: Rows


def episodes(a: Course, b: Course) -> Episodes:
    """Find them; none where they move otherwise for most of the time."""
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
    # Who is held all the time just goes slower.
    if share > (PART if held is None else 1 - PART / 4):
        rows, share, held = np.zeros_like(rows), 0.0, None
    now = np.linalg.norm(steps[0], axis=1)
    return Episodes(rows, share, held, now <= STANDS * usual)


def _sizes(a: Course) -> Array:
    """What parts of a step count (size,): a turn as the way that it mostly makes."""
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
    """Without those that do not last."""
    edges = np.flatnonzero(np.diff(np.r_[0, rows, 0]))
    found = np.zeros_like(rows)
    for begin, end in edges.reshape(-1, 2):
        found[begin:end] = end - begin > least
    return found

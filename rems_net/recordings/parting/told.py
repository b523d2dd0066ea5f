"""What it makes that two robots were not told the same."""

from __future__ import annotations

import numpy as np

from rems_net.recordings.parting.both import Both
from rems_net.recordings.parting.course import Array, Course


def told(both: Both, a: Course, b: Course, field: str = "") -> Array | None:
    """What the steps of `a` would be more, had it been told what `b` was (n, size).

    By what both mostly made of their commands: so fast for so much; or, where the
    command has the same `field` as the state, so far for so much, if that is nearer to
    the truth. None where both were told the same.
    """
    names = list(both.fields("command"))
    pairs = [both.numbers(name) for name in names]
    if all(np.array_equal(one, other) for one, other in pairs):
        return None
    columns = [np.stack(c, axis=1) for c in zip(*pairs, strict=True)]
    sums = [_sums(both, c, a.time) for c in columns]
    found: Array = (sums[1] - sums[0]) @ _answer(np.concatenate(sums), _steps(a, b))
    same = field.replace("state/", "command/", 1)
    if same not in names:
        return found
    rows = np.searchsorted(both.time, a.time)
    one, other = (c[rows, names.index(same)] for c in columns)
    known = np.stack((np.ones(2 * len(rows)), np.r_[one, other]), axis=1)
    aims = _answer(known, np.r_[a.points, b.points])[1] * (other - one)[:, None]
    both_ways = found, np.diff(aims, axis=0)
    nearest: Array = min(both_ways, key=lambda more: _error(a, b, more))
    return nearest


def _sums(both: Both, columns: Array, time: Array) -> Array:
    """Commands times how long they held, from one point to the next (n, fields)."""
    lasts = np.diff(both.time, prepend=min(time[0], both.time[0]))[:, None]
    added = (columns * lasts).cumsum(axis=0)
    # A row holds until its time: nothing at the start is one more point.
    when = np.concatenate((both.time[:1] - lasts[0], both.time))
    sums = np.concatenate((np.zeros_like(added[:1]), added))
    found: Array = np.diff([np.interp(time, when, c) for c in sums.T], axis=1).T
    return found


def _steps(a: Course, b: Course) -> Array:
    return np.concatenate((a.steps(), b.steps()))


def _answer(asked: Array, made: Array) -> Array:
    found: Array = np.linalg.lstsq(asked, made, rcond=1e-9)[0].astype(float)
    return found


def _error(a: Course, b: Course, more: Array) -> float:
    return float(np.square(a.led(a.points[0], a.steps() + more) - b.points).sum())

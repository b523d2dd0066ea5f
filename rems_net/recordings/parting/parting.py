"""Why two robots part: the simplest explanation that accounts for most of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rems_net.recordings.comparison import APART, POSE, unit_factor
from rems_net.recordings.parting import sentences
from rems_net.recordings.parting.episodes import episodes
from rems_net.recordings.parting.kinds import changed
from rems_net.recordings.parting.pair import RobotPair
from rems_net.recordings.parting.trajectory import Array, StepTrajectory
from rems_net.recordings.parting.trajectory_pair import TrajectoryPair
from rems_net.recordings.parting.trial import ENOUGH, Found, explained, tried
from rems_net.recordings.parting.where import Where, where

#: rows that are compared; a longer recording is thinned out to so many
ROWS = 1000
#: fraction of the movement. A smaller difference is rounding.
ROUNDING = 1e-7
#: Smallest differences that matter: in these units, and as a fraction of the movement;
#: 0.1 mm, 0.006 degrees.
CARE = dict.fromkeys(("m", "rad", "m/s", "rad/s"), 1e-4)
SHARE = 1e-3
#: fraction of the difference. An explanation must account for more.
HALF = 0.5
#: rows. Fewer are not enough to find a cause.
FEW = 10
#: largest correlation of successive values that still counts as noise
WHITE = 0.3
#: names of the coordinates of a pose's steps
PARTS = ("its way ahead", "its way sideways", "its heading")


@dataclass(frozen=True)
class Cause:
    """One part of an explanation.

    kind: one of those in `kinds.py`, or noise
    numbers: fitted values: a factor; rad/s, rad/m or m/s; s
    share: of the difference (sum of squares) that it explains with those before it
    says: how the second robot differs      look: where to look next
    """

    kind: str
    numbers: tuple[float, ...]
    share: float
    says: str
    look: str


@dataclass(frozen=True)
class Parting:
    """Where and why `b` parts from `a`, in their poses or in one field of the state.

    rows: how many rows were compared
    rms: of the difference, in `unit`; of poses in m, with a heading as a length
    where: None if the difference is too small to matter, or the rows are too few
    causes: each with those before it; empty if nothing explains more than half
    tried: every kind, alone and with the known ones, the best first
    through: of poses, the share that the way ahead of `b` explains, its way sideways,
        and its heading, each alone
    """

    a: str
    b: str
    field: str
    unit: str
    rows: int
    rms: float
    where: Where | None
    causes: Sequence[Cause]
    tried: Sequence[Sequence[Cause]]
    through: Mapping[str, float]


def parting(both: RobotPair, field: str = "") -> Parting:
    """Explain the difference of one field of the state; without one, of the poses."""
    a, b = both.trajectories(field) if field else both.drives()
    rows = np.unique(np.linspace(0, len(a.time) - 1, ROWS).astype(int))
    a, b = (type(one)(one.time[rows], one.points[rows]) for one in (a, b))
    unit = both.a.unit(field) if field else "m"
    off = (b.points - a.points) * a.weights()
    rms = float(np.sqrt(np.square(off).sum(axis=1).mean()))
    size = float(np.abs(a.points * a.weights()).max())
    names = both.a.name, both.b.name
    said = *names, field, unit, len(both.time), rms
    if rms <= _little(unit, size) or len(both.time) < FEW:
        return Parting(*said, None, [], [], {})
    there = where(both, a, b, 0.0 if field else APART)
    aimed = field.replace("state/", "command/", 1) in both.fields("command")
    started = both.started([field] if field else [name for name, _ in POSE])
    case = TrajectoryPair(a, b, told(both, a, b, field), episodes(a, b), started, aimed)
    found = tried(case)

    def causes(one: Found, shares: Sequence[float]) -> list[Cause]:
        return [
            Cause(
                name,
                tuple(map(float, one.numbers[name])),
                share,
                sentences.says(name, one.numbers, both, case, field),
                sentences.look(name, one.numbers, both, case),
            )
            for name, share in zip(one.numbers, shares, strict=True)
        ]

    every = [causes(one, [one.share] * len(one.numbers)) for one in found]
    best: list[Cause] = []
    if (noise := _noise(off)) > max(HALF, *(one.worth(case) for one in found)):
        best = [_noisy(off, noise, unit)]
    else:
        more = explained(case, found[0])
        left = (b.points - changed(case, more[-1].numbers)) * a.weights()
        noise = more[-1].share + _noise(left) * (1 - more[-1].share)
        if more[-1].share > HALF:
            shares = [more[0].share] * len(more[0].numbers)
            best = causes(more[-1], shares + [one.share for one in more[1:]])
            if field.startswith("sensors/") and noise > max(ENOUGH, more[-1].share):
                best.append(_noisy(left, noise, unit))
    through = _through(case) if a.turns else {}
    return Parting(*said, there, best, every, through)


def _little(unit: str, size: float) -> float:
    """Return the largest difference that does not matter, for movements of a size."""
    least = [most * (unit_factor(si, unit) or 0.0) for si, most in CARE.items()]
    return max(ROUNDING * size, *(min(one, SHARE * size) for one in least), 0.0)


def _noisy(off: Array, share: float, unit: str) -> Cause:
    rms = float(np.sqrt(np.square(off).sum(axis=1).mean()))
    size = f"{1e3 * rms:.2g} mm" if unit == "m" else f"{rms:.2g} {unit}".strip()
    look = "the noise of its sensors"
    return Cause("noise", (rms,), share, f"is noisy: {size} rms", look)


def _noise(off: Array) -> float:
    """Return the share of a difference that is white noise; 0 for none."""
    off = off[1:]  # the start is not measured
    total = float(np.square(off).sum())
    about = off - off.mean(axis=0)
    white = float(np.square(about).sum())
    again = float((about[1:] * about[:-1]).sum()) / white if white else 1.0
    return white / total if abs(again) < WHITE else 0.0


def _through(case: TrajectoryPair) -> dict[str, float]:
    """Return the share that each part of the steps of `b` explains alone."""
    a, b, found = case.a, case.b, {}
    off = float(np.square((a.points - b.points) * a.weights()).sum())
    for k, name in enumerate(PARTS):
        steps = a.steps()
        steps[:, k] = b.steps()[:, k]
        left = (a.led(a.points[0], steps) - b.points) * a.weights()
        found[name] = 1 - float(np.square(left).sum()) / off
    return found


def told(
    both: RobotPair, a: StepTrajectory, b: StepTrajectory, field: str = ""
) -> Array | None:
    """Return the change of the steps of `a` if it got the commands of `b` (n, size).

    Commands are converted by a fit over both robots: either a speed per command or, if
    the command has the same `field` as the state, a position per command; the one
    closer to `b` is used. None if both received the same commands.
    """
    names = list(both.fields("command"))
    pairs = [both.numbers(name) for name in names]
    if all(np.array_equal(one, other) for one, other in pairs):
        return None
    columns = [np.stack(c, axis=1) for c in zip(*pairs, strict=True)]
    sums = [_sums(both, c, a.time) for c in columns]
    steps = np.concatenate((a.steps(), b.steps()))
    found: Array = (sums[1] - sums[0]) @ _answer(np.concatenate(sums), steps)
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


def _sums(both: RobotPair, columns: Array, time: Array) -> Array:
    """Return the commands times their duration, from point to point (n, fields)."""
    lasts = np.diff(both.time, prepend=min(time[0], both.time[0]))[:, None]
    added = (columns * lasts).cumsum(axis=0)
    # A row holds until its time, so the sum begins with one more point.
    when = np.concatenate((both.time[:1] - lasts[0], both.time))
    sums = np.concatenate((np.zeros_like(added[:1]), added))
    found: Array = np.diff([np.interp(time, when, c) for c in sums.T], axis=1).T
    return found


def _answer(asked: Array, made: Array) -> Array:
    found: Array = np.linalg.lstsq(asked, made, rcond=1e-9)[0].astype(float)
    return found


def _error(a: StepTrajectory, b: StepTrajectory, more: Array) -> float:
    return float(np.square(a.led(a.points[0], a.steps() + more) - b.points).sum())

"""Kinds of explanations: how each changes the trajectory of `a`, by a few numbers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rems_net.recordings.parting.trajectory import Array, StepTrajectory, late
from rems_net.recordings.parting.trajectory_pair import TrajectoryPair

#: fraction of the recording, s. Longest delay that is tried.
LATEST, LATE = 0.25, 2.0
#: delays in each direction of the first search
TRIES = 20
#: s, count. Duration of a jolt, and number of candidates that are tried.
JOLT, PEAKS = 0.1, 5
#: fraction of the run. If `a` stands still for less than this, we do not know whether
#: `b` creeps.
OFTEN = 0.1
#: Suspect a speed limit in `b` only if the top speed of `a` is at least 5 % higher.
FASTER = 1.05
#: A negative factor no further than this from -1 is a wrong sign.
SIGN = 0.1
#: fraction of the largest movement. A coordinate that moves less hardly moves.
LITTLE = 0.01
#: Total movement up to this is standing: numerical noise of a physics engine.
STANDS = 1e-12


@dataclass(frozen=True)
class Kind:
    """One kind of explanation. The more it takes for granted, the more it costs.

    like: kinds with which it cannot be combined
    seen: whether its numbers are measured, not fitted
    sound: whether its numbers are possible
    able: whether it is possible in this case
    guess: first numbers (k,), from the case and the steps to be explained
    change: the steps (n, size) that these numbers make
    """

    name: str
    cost: float
    able: Callable[[TrajectoryPair], bool]
    guess: Callable[[TrajectoryPair, Array], Array] = lambda case, steps: np.zeros(0)
    change: Callable[[TrajectoryPair, Array, Array], Array] = lambda case, steps, by: (
        steps
    )
    like: tuple[str, ...] = ()
    seen: bool = False
    sound: Callable[[Array], bool] = lambda by: True


def _scale(
    name: str, parts: Callable[[StepTrajectory], Sequence[int]], *like: str
) -> Kind:
    def able(case: TrajectoryPair) -> bool:
        which = set(parts(case.a))
        groups = [part for part in (case.a.ways, case.a.turns) if which & set(part)]
        return bool(groups) and all(_goes(case, part) for part in groups)

    def guess(case: TrajectoryPair, steps: Array) -> Array:
        which = list(parts(case.a))
        one, other = steps[:, which], case.b.steps()[:, which]
        return _slope(one, other)

    def change(case: TrajectoryPair, steps: Array, by: Array) -> Array:
        factors = np.ones(case.a.size)
        factors[list(parts(case.a))] = by[0]
        return steps * factors

    return Kind(name, 0.02, able, guess, change, like, sound=_sound)


def _slope(one: Array, other: Array) -> Array:
    """Return the factor that best turns `one` into `other`, (1,); 0 if `one` stands."""
    size = float(np.square(one).sum())
    return np.array([(one * other).sum() / size if size > STANDS**2 else 0.0])


def _sound(by: Array) -> bool:
    """Return whether a factor is plausible: a negative one only as a wrong sign."""
    return bool(by[0] >= 0 or abs(by[0] + 1) < SIGN)


def _goes(case: TrajectoryPair, part: Sequence[int]) -> bool:
    """Return whether it moves in this part of its steps, compared to the others."""
    gone = np.abs(case.a.steps()).sum(axis=0) * case.a.weights()
    return bool(gone[list(part)].max() > max(LITTLE * gone.max(), STANDS))


def _offset(case: TrajectoryPair, steps: Array) -> Array:
    found: Array = (case.b.points - case.a.points).mean(axis=0)
    return found


def _drift(case: TrajectoryPair, steps: Array) -> Array:
    return np.array([(case.b.steps() - steps)[:, -1].sum() / case.a.dt().sum()])


def _drifted(case: TrajectoryPair, steps: Array, by: Array) -> Array:
    more = np.zeros_like(steps)
    more[:, -1] = by[0] * case.a.dt()[:, 0]
    return steps + more


def _bend(case: TrajectoryPair, steps: Array) -> Array:
    ahead = steps[:, 0]
    more = (case.b.steps() - steps)[:, -1]
    return _slope(ahead, more)


def _bent(case: TrajectoryPair, steps: Array, by: Array) -> Array:
    more = np.zeros_like(steps)
    more[:, -1] = by[0] * steps[:, 0]
    return steps + more


def _creep(case: TrajectoryPair, steps: Array) -> Array:
    rows = case.apart.standing
    more = (case.b.steps() - steps)[rows].sum(axis=0)
    found: Array = more / case.a.dt()[rows].sum()
    return found


def _crept(case: TrajectoryPair, steps: Array, by: Array) -> Array:
    found: Array = steps + case.apart.standing[:, None] * case.a.dt() * by
    return found


def _jolt(case: TrajectoryPair, steps: Array) -> Array:
    """Return the time [s] of a jolt, and the excess of all steps around it."""
    dt = case.a.dt()
    more = case.b.steps() - steps
    wide = max(1, min(len(more), round(JOLT / float(np.median(dt)))))
    sums = np.stack([np.convolve(part, np.ones(wide), "same") for part in more.T], 1)
    sizes = np.linalg.norm(sums * case.a.weights(), axis=1)
    tries: list[Array] = [np.r_[case.a.time[k + 1], sums[k]] for k in _peaks(sizes)]
    left = [case.a.led(case.a.points[0], _jolted(case, steps, by)) for by in tries]
    errors = [np.square((p - case.b.points) * case.a.weights()).sum() for p in left]
    return tries[int(np.argmin(errors))]


def _peaks(sizes: Array) -> list[int]:
    """Return the largest of the local maxima."""
    around = np.r_[0.0, sizes, 0.0]
    tops = np.flatnonzero((sizes >= around[:-2]) & (sizes >= around[2:]))
    return [int(k) for k in tops[np.argsort(-sizes[tops])][:PEAKS]]


def _jolted(case: TrajectoryPair, steps: Array, by: Array) -> Array:
    found = steps.copy()
    found[np.searchsorted(case.a.time, by[0] - 1e-9) - 1] += by[1:]
    return found


def _fastest(case: TrajectoryPair, steps: Array) -> Array:
    speeds = np.abs(case.b.steps()[:, :1] / case.a.dt())
    most: Array = speeds.max(axis=0)
    return most


def _limited(case: TrajectoryPair, steps: Array, by: Array) -> Array:
    """Limit the speed; with a commanded position, make up for the distance later."""
    found, most = steps.copy(), abs(by[0]) * case.a.dt()[:, 0]
    if not case.aimed:
        found[:, 0] = np.clip(steps[:, 0], -most, most)
        return found
    left = 0.0
    for k, step in enumerate(steps[:, 0]):
        left += step
        found[k, 0] = min(max(left, -most[k]), most[k])
        left -= found[k, 0]
    return found


def _faster(case: TrajectoryPair) -> bool:
    """Return whether `a` was faster than `b` at times."""
    both = [np.abs(c.steps()[:, 0] / c.dt()[:, 0]).max() for c in (case.a, case.b)]
    return bool(both[0] > FASTER * both[1] > STANDS)


def _told(case: TrajectoryPair, steps: Array, by: Array) -> Array:
    assert case.commanded is not None
    return steps + case.commanded


def _other(case: TrajectoryPair, steps: Array, by: Array) -> Array:
    return np.where(case.apart.rows[:, None], case.b.steps(), steps)


def _elsewhere(case: TrajectoryPair) -> bool:
    """Return whether the starts differ, if "offset" is not the same explanation."""
    return case.elsewhere and (case.started or bool(case.a.turns))


def _moves(case: TrajectoryPair) -> bool:
    return bool(np.any(case.a.steps()))


def _stands(case: TrajectoryPair) -> bool:
    return bool(case.apart.standing.mean() > OFTEN)


#: Known kinds, then those with one number, then those with more, in the order in which
#: they change a trajectory. "start", "offset" and "later" change points: see `changed`.
KINDS: Mapping[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind("told", 0.01, lambda case: case.commanded is not None, change=_told),
        Kind("start", 0.01, _elsewhere),
        _scale(
            "all", lambda a: range(a.size) if a.turns else (), "way", "turn", "limit"
        ),
        _scale("way", lambda a: a.ways, "all", "limit"),
        _scale("turn", lambda a: a.turns, "all"),
        Kind("offset", 0.02, lambda case: not case.a.turns, _offset, like=("start",)),
        Kind("drift", 0.02, lambda case: True, _drift, _drifted, ("bend",)),
        Kind(
            "bend",
            0.02,
            lambda case: bool(case.a.turns) and _goes(case, case.a.ways),
            _bend,
            _bent,
            ("drift",),
        ),
        Kind("creep", 0.04, _stands, _creep, _crept),
        Kind("limit", 0.02, _faster, _fastest, _limited, ("way", "all")),
        Kind("jolt", 0.03, lambda case: True, _jolt, _jolted, seen=True),
        Kind("later", 0.02, _moves),
        Kind("episode", 0.05, lambda case: bool(case.apart.rows.any()), change=_other),
    )
}
KNOWN = ("told", "start")


def changed(case: TrajectoryPair, numbers: Mapping[str, Array]) -> Array:
    """Return the points of `a`, changed by these kinds with their numbers."""
    steps = case.a.steps()
    for name, kind in KINDS.items():
        if name in numbers:
            steps = kind.change(case, steps, numbers[name])
    points = case.a.led(case.start(numbers), steps) + numbers.get("offset", 0.0)
    if "later" in numbers:
        points = late(points, case.a.time, float(numbers["later"][0]))
    return points


def guessed(case: TrajectoryPair, name: str, numbers: Mapping[str, Array]) -> Array:
    """Return first numbers of one more kind."""
    points = changed(case, numbers)
    if name != "later":
        return KINDS[name].guess(case, type(case.a)(case.a.time, points).steps())
    longest = min(LATE, LATEST * float(np.ptp(case.a.time)))
    ticks = float(np.median(case.a.dt())) * np.array([-2, -1, 1, 2])
    tries = np.r_[np.linspace(-longest, longest, 2 * TRIES + 1), ticks]
    errors = [
        np.square((late(points, case.a.time, t) - case.b.points) * case.a.weights())
        for t in tries
    ]
    return np.array([tries[int(np.argmin([error.sum() for error in errors]))]])

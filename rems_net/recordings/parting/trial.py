"""Search for the kinds of explanations that explain a difference best."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from rems_net.recordings.parting.kinds import KINDS, KNOWN, changed, guessed
from rems_net.recordings.parting.trajectory import Array
from rems_net.recordings.parting.trajectory_pair import TrajectoryPair

#: fractions of the difference. A further explanation must explain at least MORE, and
#: PART of the rest; above ENOUGH the search ends.
MORE, PART, ENOUGH = 0.02, 1 / 3, 0.95
#: kinds in one explanation, beside the known ones: more would fit anything
TOGETHER = 2
#: fraction. Additional cost of an episode that lasts for the whole run.
LONG = 0.25
#: fraction. Additional cost of an episode if the commands differ, too.
OTHER = 0.15
#: rounds of a fit, and attempts in each, each with half the step before
ROUNDS, HALVINGS = 8, 4
#: change of a number that gives its slope; least relative gain of a round
STEP, LEAST = 1e-6, 1e-4


@dataclass(frozen=True)
class Found:
    """An explanation: kinds with their numbers, and the share that they explain.

    The share is 1 - (sum of squares left) / (sum of squares of the difference).
    """

    numbers: Mapping[str, Array]
    share: float

    def cost(self, case: TrajectoryPair) -> float:
        """Return the cost of its assumptions, as a fraction."""
        cost = sum(KINDS[name].cost for name in self.numbers)
        if "episode" in self.numbers:
            cost += OTHER * (case.commanded is not None)
            if case.apart.held is None:  # a robot that is held may be held for long
                cost += LONG * case.apart.share
        return cost

    def worth(self, case: TrajectoryPair) -> float:
        """Return its share less its cost."""
        return self.share - self.cost(case)


def tried(case: TrajectoryPair) -> list[Found]:
    """Return each kind, alone or with the known ones; the best first."""
    found = [_found(case, {}, names) for names in _first(case)]
    best: dict[frozenset[str], Found] = {}
    for one in sorted(found, key=lambda one: -one.worth(case)):
        best.setdefault(frozenset(one.numbers.keys() - set(KNOWN)), one)
    return list(best.values())


def explained(case: TrajectoryPair, first: Found) -> list[Found]:
    """Return the first explanation, then those with one more kind each."""
    best = [first]
    while best[-1].share < ENOUGH and len(best) < TOGETHER:
        last = best[-1]
        further = [
            _found(case, last.numbers, (name,))
            for name in _able(case)
            if not {name, *KINDS[name].like} & last.numbers.keys()
        ]
        if not further:
            break
        most = max(further, key=lambda one: one.worth(case))
        if most.share - last.share < max(MORE, PART * (1 - last.share)):
            break
        best.append(most)
    return best


def _able(case: TrajectoryPair) -> list[str]:
    return [name for name, kind in KINDS.items() if kind.able(case)]


def _first(case: TrajectoryPair) -> Iterator[tuple[str, ...]]:
    able = _able(case)
    known = [name for name in able if name in KNOWN]
    beside = [(), *((name,) for name in able if name not in KNOWN)]
    for count in range(len(known) + 1):
        for some in combinations(known, count):
            yield from (some + one for one in beside if some + one)


def _found(
    case: TrajectoryPair, before: Mapping[str, Array], names: Sequence[str]
) -> Found:
    """Fit these kinds to the case, together with those before."""
    numbers = dict(before)
    for name in names:
        numbers[name] = guessed(case, name, numbers)
    weights, aim = case.a.weights(), case.b.points
    free = [name for name in numbers if not KINDS[name].seen]
    sizes = np.cumsum([len(numbers[name]) for name in free])[:-1]

    def parts(flat: Array) -> dict[str, Array]:
        # Without numbers to fit, `split` still returns one empty part.
        return numbers | dict(zip(free, np.split(flat, sizes), strict=False))

    def residual(flat: Array) -> Array:
        found: Array = ((changed(case, parts(flat)) - aim) * weights).ravel()
        return found

    total = float(np.square((case.a.points - aim) * weights).sum())
    first = np.concatenate([np.zeros(0), *(numbers[name] for name in free)])
    flat, left = _fit(residual, first)
    best = parts(flat)
    sound = all(KINDS[name].sound(by) for name, by in best.items())
    return Found(best, 1 - left / total if sound else 0.0)


def _fit(residual: Callable[[Array], Array], first: Array) -> tuple[Array, float]:
    """Return the numbers (k,) with the least sum of squared residuals, and the sum."""
    best, at = first, residual(first)
    least = float(at @ at)
    for _ in range(ROUNDS if len(first) else 0):
        slopes = np.stack([_slope(residual, best, at, i) for i in range(len(best))])
        way = np.linalg.lstsq(slopes.T, -at, rcond=1e-9)[0]
        before = least
        for half in range(HALVINGS):
            there = best + way / 2**half
            found = residual(there)
            if (total := float(found @ found)) < least:
                best, at, least = there, found, total
                break
        if least > (1 - LEAST) * before:
            break
    return best, least


def _slope(
    residual: Callable[[Array], Array], where: Array, at: Array, i: int
) -> Array:
    there = where.copy()
    there[i] += STEP
    return (residual(there) - at) / STEP

"""Gate: whether a correction helps, measured over seconds, before it was learned.

A network that predicts the next step well can still lead astray: small errors add up.
So pairs of predictions begin at the robot's own pose, twice a second. One of each pair
has the corrections as they are at the time. After 1, 2, 5 and 10 s both are compared
with where the robot is.
"""

from collections import deque
from collections.abc import Sequence
from math import sqrt
from typing import Any

import numpy as np

from rems_net.drivers.kinematic.correction import Floats
from rems_net.maths import sincos

#: s. Time between the beginnings of two pairs, and times after which they are compared.
BEGIN, HORIZONS = 0.5, (1.0, 2.0, 5.0, 10.0)
#: Comparisons that count, of each horizon, and that are needed at least.
LAST, FEW = 40, 8
#: m. Smaller errors without a correction need none.
LITTLE = 1e-4
#: Largest share of the mean square error that is left at the first horizon, and at
#: others, to open: less could be chance. The second pair keeps an open gate open.
SHARES = ((0.7, 0.9), (0.85, 1.0))
#: How many times its own uncertainty the gain must be: to open, and to stay open.
SURE = (3.0, 1.5)
#: Comparisons of the first horizon overlap by half: so many count as one.
OVERLAP = 2.0


class Gate:
    """Pairs of predictions on their way, and how far off those were that have ended."""

    def __init__(self, step: float):
        #: in ticks
        self.begin = max(1, round(BEGIN / step))
        self.horizons = [max(1, round(one / step)) for one in HORIZONS]
        #: by horizon: squared errors [m2], without and with the correction
        self.errors = [deque[Floats](maxlen=LAST) for _ in HORIZONS]
        self.open = False
        self._n = 0
        self.restart()

    def restart(self) -> None:
        """Drop the pairs on their way: the robot was moved by another hand."""
        self._ages: list[int] = []
        #: (pairs, 3, 3): real, without, with; x, y, heading since each began
        self._poses = np.zeros((0, 3, 3))

    def add(
        self, real: Sequence[float], alone: Sequence[float], corrected: Sequence[float]
    ) -> None:
        """Add one step of each, seen from where it begins: m, m, rad."""
        if self._n % self.begin == 0:
            self._ages.append(0)
            self._poses = np.concatenate([self._poses, np.zeros((1, 3, 3))])
        self._n += 1
        _compose(self._poses, np.array([real, alone, corrected]))
        self._ages = [age + 1 for age in self._ages]
        for i, horizon in enumerate(self.horizons):
            if horizon in self._ages:
                self._compare(i, self._poses[self._ages.index(horizon)])
        if self._ages[0] >= self.horizons[-1]:
            self._ages, self._poses = self._ages[1:], self._poses[1:]
        self.open = self._helps(int(self.open))

    def error(self, horizon: int, which: int) -> float:
        """Return the RMS distance [m] of a horizon; which: 0 alone, 1 corrected."""
        found = self.errors[horizon]
        return sqrt(sum(float(one[which]) for one in found) / max(1, len(found)))

    def _compare(self, horizon: int, poses: Floats) -> None:
        off = poses[1:, :2] - poses[0, :2]
        self.errors[horizon].append((off * off).sum(axis=1))

    def _helps(self, stays: int) -> bool:
        """Return whether the gate is open. stays: 1 if it is open already, else 0."""
        first, *later = self.errors
        if len(first) < FEW or self.error(0, 0) < LITTLE:
            return False
        gains = np.array([alone - corrected for alone, corrected in first])
        doubt = gains.std() * sqrt(OVERLAP / len(gains))
        near, far = SHARES[stays]
        return bool(gains.mean() > SURE[stays] * doubt) and all(
            sum(float(one[1]) for one in some)
            <= share * sum(float(one[0]) for one in some)
            for some, share in [(first, near), *((one, far) for one in later)]
            if len(some) >= FEW
        )


def _compose(poses: Any, steps: Floats) -> None:
    """Move poses (n, k, 3) by steps (k, 3), each seen from its pose."""
    sine, cosine = sincos(np.ascontiguousarray(poses[:, :, 2]))
    x, y = steps[:, 0], steps[:, 1]
    poses[:, :, 0] += x * cosine - y * sine
    poses[:, :, 1] += x * sine + y * cosine
    poses[:, :, 2] += steps[:, 2]

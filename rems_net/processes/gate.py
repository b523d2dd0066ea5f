"""Gate: whether a correction helps, measured over seconds, before it was learned.

A network that predicts the next step well can still lead astray: small errors add up.
So pairs of predictions begin at the robot's own pose, twice a second. One of each pair
has the corrections as they are at the time. After 1, 2, 5 and 10 s both are compared
with where the robot is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rems_net.drivers.kinematic.correction import Floats
from rems_net.maths import sincos

#: s. Time between the beginnings of two pairs, and times after which they are compared.
BEGIN, HORIZONS = 0.5, (1.0, 2.0, 5.0, 10.0)
#: Share of the sums that a new comparison leaves: the last ten count.
KEEP = 0.9
#: Comparisons that are needed, at least.
FEW = 4
#: Largest mean square error at the first horizon, and at others, with which a gate
#: opens: a share of the error without the correction.
OPENS = (0.8, 0.9)
#: and with which it closes
CLOSES = (1.0, 1.0)


class Gate:
    """Pairs of predictions on their way, and how far off those were that have ended."""

    def __init__(self, step: float):
        #: in ticks
        self.begin = max(1, round(BEGIN / step))
        self.horizons = [max(1, round(one / step)) for one in HORIZONS]
        #: sums of squares [m2], by horizon: without and with the correction
        self.sums = np.zeros((len(HORIZONS), 2))
        self.counts = [0] * len(HORIZONS)
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
        self.open = self._helps(*(CLOSES if self.open else OPENS))

    def error(self, horizon: int, which: int) -> float:
        """Return the RMS distance [m] of a horizon; which: 0 alone, 1 corrected."""
        weight = (1 - KEEP ** self.counts[horizon]) / (1 - KEEP)
        return float(np.sqrt(self.sums[horizon, which] / max(weight, 1.0)))

    def _compare(self, horizon: int, poses: Floats) -> None:
        off = poses[1:, :2] - poses[0, :2]
        self.sums[horizon] = KEEP * self.sums[horizon] + (off * off).sum(axis=1)
        self.counts[horizon] += 1

    def _helps(self, first: float, later: float) -> bool:
        if self.counts[0] < FEW:
            return False
        shares = [first, *[later] * (len(HORIZONS) - 1)]
        return all(
            corrected <= share * alone
            for share, (alone, corrected), count in zip(
                shares, self.sums.tolist(), self.counts, strict=True
            )
            if count >= FEW
        )


def _compose(poses: Any, steps: Floats) -> None:
    """Move poses (n, k, 3) by steps (k, 3), each seen from its pose."""
    sine, cosine = sincos(np.ascontiguousarray(poses[:, :, 2]))
    x, y = steps[:, 0], steps[:, 1]
    poses[:, :, 0] += x * cosine - y * sine
    poses[:, :, 1] += x * sine + y * cosine
    poses[:, :, 2] += steps[:, 2]

"""A case: two courses that part, and what is known beside."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rems_net.recordings.parting.course import Array, Course
from rems_net.recordings.parting.episodes import Episodes


@dataclass(frozen=True)
class Case:
    """Two courses that part, at the same times, and what is known beside.

    told (n, size): what the steps of `a` would be more with the commands of `b`; None
        where both were told the same
    started: whether the first points are where they were before their first step
    aimed: whether the command says where to go, and not how fast
    """

    a: Course
    b: Course
    told: Array | None
    apart: Episodes
    started: bool
    aimed: bool = False

    @cached_property
    def elsewhere(self) -> bool:
        """Whether they did not start at the same place.

        Where nobody knows the start, the first step is over: twice as much is needed.
        """
        weights = self.a.weights()
        off = (self.b.points[0] - self.a.points[0]) * weights
        first = [one.steps()[0] * weights for one in (self.a, self.b)]
        gone = 0.0 if self.started else 2 * max(map(np.linalg.norm, first))
        return bool(np.linalg.norm(off) > max(gone, 1e-9))

    def start(self, numbers: Mapping[str, Array]) -> Array:
        """Where a changed course of `a` begins: where `b` does, if that is known.

        If nobody knows the start, a pose is a step away from it, which is what explains
        the rest; and a number that goes k times as far is k times as large.
        """
        a: Array = self.a.points[0]
        b: Array = self.b.points[0]
        if "start" in numbers:
            return b
        if self.started:
            return a
        if "episode" in numbers:  # which may begin with the run
            return b
        if self.a.turns:
            return a if self.elsewhere or "later" in numbers else b
        scaled: Array = a * numbers.get("way", 1.0)
        return scaled

"""A pair of trajectories that part, and further facts about them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rems_net.recordings.parting.episodes import Episodes
from rems_net.recordings.parting.trajectory import Array, StepTrajectory


@dataclass(frozen=True)
class TrajectoryPair:
    """Two trajectories that part, at the same times, and further facts about them.

    commanded (n, size): change of the steps of `a` with the commands of `b`; None if
        both received the same
    started: whether the first points precede the first step
    aimed: whether the command is a position, not a speed
    """

    a: StepTrajectory
    b: StepTrajectory
    commanded: Array | None
    apart: Episodes
    started: bool
    aimed: bool = False

    @cached_property
    def elsewhere(self) -> bool:
        """Whether the starts differ; if unknown, by more than two first steps."""
        weights = self.a.weights()
        off = (self.b.points[0] - self.a.points[0]) * weights
        first = [one.steps()[0] * weights for one in (self.a, self.b)]
        gone = 0.0 if self.started else 2 * max(map(np.linalg.norm, first))
        return bool(np.linalg.norm(off) > max(gone, 1e-9))

    def start(self, numbers: Mapping[str, Array]) -> Array:
        """Return where a changed trajectory of `a` begins: where `b` does, if known.

        If the start is unknown, a pose is one step away from it, so the other
        explanations account for it; a number that moves k times as far starts k times
        as large.
        """
        a: Array = self.a.points[0]
        b: Array = self.b.points[0]
        if "start" in numbers:
            return b
        if self.started:
            return a
        if "episode" in numbers:  # an episode may begin with the run
            return b
        if self.a.turns:
            return a if self.elsewhere or "later" in numbers else b
        scaled: Array = a * numbers.get("way", 1.0)
        return scaled

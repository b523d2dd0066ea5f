"""Why two robots of a recording part: in their poses, in each field of the state."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rems_net.errors import ExperimentError
from rems_net.recordings.comparison import POSE
from rems_net.recordings.parting.pair import RobotPair
from rems_net.recordings.parting.parting import Cause, Parting, parting
from rems_net.recordings.parting.text import detail, line


@dataclass(frozen=True, repr=False)
class Why:
    """Where and why robot `b` parts from robot `a`; its repr is the full text.

    partings: of the poses, if both have one; then of each field of the states, the
        largest difference first; if no state differs, those of sensors come before
    far: which robot had run away at the end of the compared rows; "" for none
    """

    a: str
    b: str
    partings: Sequence[Parting]
    far: str = ""

    @property
    def causes(self) -> Sequence[Cause]:
        """Causes of the first parting, each with those before it; empty for none."""
        return self.partings[0].causes

    @property
    def line(self) -> str:
        """Sentence: what the second robot does, and how much that explains."""
        until = f"; then {self.far}" if self.far else ""
        return line(self.partings[0]) + until

    def __repr__(self) -> str:
        found = ["\n".join(detail(one)) for one in self.partings]
        until = [f"Compared until {self.far}."] if self.far else []
        return "\n\n".join(found + until)


def why(both: RobotPair) -> Why:
    """Compare two robots. Raises ExperimentError if there is nothing to compare."""
    a, b = both.a.name, both.b.name
    posed = {name for name, _ in POSE} if both.posed else set()
    fields = [name for name in both.fields("state") if name not in posed]
    if both.far and not len(both.time):
        raise ExperimentError(
            f"{a} and {b} cannot be compared from the first step on: {both.far}. "
            "(R0850)"
        )
    if not len(both.time) or not (posed or fields):
        what = "field of their states" if len(both.time) else "time"
        raise ExperimentError(
            f"{a} and {b} have no {what} in common, so they cannot be compared. (R0850)"
        )
    found = [parting(both, field) for field in fields]
    goes: dict[str, float] = {}  # by unit: the movement of the field that moves most
    for field in fields:
        way = float(np.ptp(both.trajectories(field)[0].points))
        unit = both.a.unit(field)
        goes[unit] = max(goes.get(unit, 0.0), way)
    found.sort(key=lambda one: -one.rms / (goes[one.unit] or 1.0))
    if posed:
        found.insert(0, parting(both))
    if not any(one.rms for one in found):  # their sensors may still differ
        found = [parting(both, field) for field in both.fields("sensors")] + found
        found.sort(key=lambda one: one.rms == 0)
    return Why(a, b, found, both.far)

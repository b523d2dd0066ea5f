"""Past: the last steps of a filter, into which a pose of an older picture is put.

A pose comes late. Counted as one of now, it is wrong by the way that the robot has gone
since. So the filter goes back to the time of the picture, and filters from there again.
"""

from collections.abc import Callable
from math import pi, sqrt
from typing import NamedTuple

import numpy as np

from rems_net.agents.runtime import SAME
from rems_net.defdict import DefDict, Schema, parse_quantity
from rems_net.drivers.kinematic.model import POSE
from rems_net.errors import ExperimentError
from rems_net.maths.ukf import Floats, Moments, cholesky, distance, updated
from rems_net.processes.fields import Turns

#: s. Steps that are kept. A frozen camera is reported after half of it.
KEPT = 1.0
#: m, m and rad. Deviations of a pose before a camera has seen the robot.
NOWHERE = (10.0, 10.0, pi / sqrt(3))
#: A pose that is so many standard deviations from the estimate, and so far (m, m and
#: rad), begins a new one: a robot was moved by hand, or its wheels were blocked.
SURE, FAR = 10.0, (0.03, 0.03, 0.2)


class Belief(NamedTuple):
    """Mean (n,) of a filter, and a root (n, k) of its covariance."""

    mean: Floats
    root: Floats


class Seen(NamedTuple):
    """A pose (3,) of a robot, and its covariance (3, 3), in the units of its state."""

    pose: Floats
    covariance: Floats


class Span(NamedTuple):
    """A step of a filter, or a part of it, with one command.

    end, dt, step: s; of this part its end and its length, and the whole step's length
    before: belief when it begins      readings, seen: at its end; None: there are none
    """

    end: float
    dt: float
    step: float
    command: Floats
    before: Belief
    readings: Floats | None = None
    seen: Seen | None = None


class Past:
    """The last spans of a filter. filtered: returns the belief at the end of one."""

    def __init__(self, filtered: Callable[[Span], Belief]):
        self._filtered = filtered
        self._spans: list[Span] = []

    def add(self, span: Span) -> Belief:
        """Return the belief after a new step."""
        while self._spans and self._spans[0].end < span.end - KEPT:
            self._spans.pop(0)
        self._spans.append(span)
        return self._filtered(span)

    def put(self, seen: Seen, at: float) -> Belief | None:
        """Return the belief of now with a pose of the time `at`, s.

        Poses are put in the order of their times. None: it is too old.
        """
        spans = self._spans
        at = min(at, spans[-1].end)
        first = next(i for i, one in enumerate(spans) if one.end > at - SAME)
        here, later = spans[first], spans[first + 1 :]
        left = here.end - at
        if left > here.dt + SAME:
            return None
        parts = [here._replace(seen=seen)]
        if left > SAME:  # in the middle of a step
            dt = max(here.dt - left, 0.0)
            parts = [
                here._replace(end=at, dt=dt, readings=None, seen=seen),
                here._replace(dt=left),
            ]
        del spans[first:]
        belief = here.before
        for one in (*parts, *later):
            spans.append(one._replace(before=belief))
            belief = self._filtered(spans[-1])
        return belief


class Poses:
    """The poses that a camera finds, as readings of a state that has x, y and heading.

    Raises ExperimentError for a state without them. who: the definition, for the error
    """

    def __init__(self, schema: Schema, who: str):
        fields = dict(schema.rows())
        if missing := [path for path in POSE if path not in fields]:
            raise ExperimentError(
                f"the state of a {who} has no {missing[0]!r}; a camera's pose corrects "
                "x, y and heading of a robot. (R1108)"
            )
        own = [fields[path] for path in POSE]
        #: places in the state; m and rad in its units
        self._at = [schema.paths.index(path) for path in POSE]
        self._units = np.array(
            [
                parse_quantity(f"1 {unit}", field.unit, f"the unit of {path!r}")
                for (path, unit), field in zip(POSE.items(), own, strict=True)
            ]
        )
        self._turns = Turns(own)

    def read(self, seen: DefDict) -> Seen:
        """Return a pose in the units of the state."""
        units = self._units
        pose = np.array([seen["x"], seen["y"], seen["heading"]])
        spread = units[:, None] * seen["covariance"] * units
        return Seen(units * pose, spread)

    def can_be(self, seen: DefDict) -> bool:
        """Return whether the covariance of a pose is one: no variance is 0."""
        return bool((np.diag(cholesky(seen["covariance"])) > 0.0).all())

    def unknown(self, belief: Belief) -> Belief:
        """Return the belief of a filter that does not know where the robot is."""
        off, spread = np.zeros(3), np.diag((self._units * NOWHERE) ** 2)
        return self._begun(belief, off, spread)

    def met(
        self, belief: Belief, seen: Seen, *, first: bool
    ) -> tuple[Belief, Floats | None]:
        """Return the belief with a pose, and how far a robot was moved: m, m and rad.

        first: whether it is the first pose, which is believed as it is
        """
        (mean, root), at = belief, self._at
        found = Moments(mean[at], root[at].T, np.zeros((3, 3)))
        off = self._turns.less(seen.pose, mean[at])
        away = np.abs(off / self._units)
        far = (away > FAR).any() and distance(found, off, seen.covariance) > SURE**2
        if first or far:
            begun = self._begun(belief, off, seen.covariance)
            return begun, None if first else away
        return Belief(*updated(mean, root, found, off, seen.covariance)), None

    def _begun(self, belief: Belief, off: Floats, spread: Floats) -> Belief:
        """Return the belief with a pose that owes nothing to what was before."""
        at, mean, old = self._at, belief.mean.copy(), belief.root.copy()
        new = np.zeros((len(mean), 3))
        mean[at] += off
        old[at], new[at] = 0.0, cholesky(spread)
        return Belief(mean, np.concatenate([old, new], axis=1))

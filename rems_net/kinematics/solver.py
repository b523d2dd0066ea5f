"""A least-squares solver with bounds: Levenberg and Marquardt's method, projected.

What is at a bound and pushed outward is held there for a step; the others take a damped
Gauss-Newton step, cut off at their bounds. Nocedal and Wright, "Numerical Optimization"
(2006), sections 10.3 and 16.7.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rems_net.kinematics.rotation import Array

#: what a step may change at most: far from the target its direction is only a guess
LONGEST = 1.0
#: a step that gains less than this share of the squares is the last
LEAST = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """What was found, (n,), and the length of what is missing."""

    q: Array
    miss: float


def fit(
    residual: Callable[[Array], Array],
    slope: Callable[[Array], Array],
    low: Array,
    high: Array,
    start: Array,
    enough: float,
    steps: int,
) -> Fit:
    """Return where within the bounds the residual is shortest, as seen from a start.

    residual: of (n,), what is missing, (m,)      slope: how it shrinks by each, (m, n)
    enough: the length at which it is found      steps: the most to take
    """
    q, missing = start, residual(start)
    cost = float(missing @ missing)
    damping = 1e-3
    jacobian = slope(q)
    for _ in range(steps):
        if cost <= enough * enough:
            break
        pull = jacobian.T @ missing
        free = ~(((q <= low) & (pull < 0)) | ((q >= high) & (pull > 0)))
        if not free.any():
            break
        part = jacobian[:, free]
        square = part.T @ part
        # By the size of the matrix: joints that barely move the tool barely move.
        size = damping * max(float(np.trace(square)), 1e-12)
        step = np.linalg.solve(square + size * np.eye(len(square)), pull[free])
        step *= min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-300))
        trial = q.copy()
        trial[free] += step
        trial = np.clip(trial, low, high)
        missing_there = residual(trial)
        cost_there = float(missing_there @ missing_there)
        if cost_there < cost:
            gain = cost - cost_there
            q, missing, cost = trial, missing_there, cost_there
            damping = max(damping / 10, 1e-15)
            if gain < LEAST * cost:
                break
            jacobian = slope(q)
        else:
            damping *= 8
            if damping > 1e8:
                break
    return Fit(q, float(np.sqrt(cost)))

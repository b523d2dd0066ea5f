"""A least-squares solver with bounds: Levenberg and Marquardt's method, projected.

A value at a bound that is pushed outward is kept for the step; the others take a damped
Gauss-Newton step, cut off at their bounds. Nocedal and Wright, "Numerical Optimization"
(2006), sections 10.3 and 16.7.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rems_net.kinematics.rotation import Array

#: rad or m. Longest step of a value: far from the target its direction is only a guess.
LONGEST = 1.0
#: Share of the sum of squares. A step that gains less is the last.
LEAST = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """The best values, (n,), and the length of the residual there."""

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
    """Return the shortest residual within the bounds that is found from a start.

    residual: of (n,), error (m,)      slope: decrease of the error by each, (m, n)
    enough: length at which the search ends      steps: greatest number of steps
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
        # Scaled by the matrix: joints that hardly move the tool hardly move.
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

"""Least squares of a few numbers: Gauss and Newton's, which never goes uphill."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUNDS, HALVINGS = 8, 4
#: of a number by which its slope is found; of the sum below which nothing is gained
STEP, ENOUGH = 1e-6, 1e-4


def fit(residual: Callable[[Array], Array], first: Array) -> tuple[Array, float]:
    """The numbers (k,) that make the sum of squares of `residual` small, and it."""
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
        if least > (1 - ENOUGH) * before:
            break
    return best, least


def _slope(
    residual: Callable[[Array], Array], where: Array, at: Array, i: int
) -> Array:
    there = where.copy()
    there[i] += STEP
    return (residual(there) - at) / STEP

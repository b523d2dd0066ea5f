"""Ukf: arithmetic of an unscented Kalman filter (Julier, Uhlmann; van der Merwe, 2004).

A belief is a mean and a *root*: a matrix that gives the covariance when multiplied by
its own transpose. An update changes the root by Potter's rule, reading by reading: no
matrix is factored, and no variance can become negative. There are only sums, products,
quotients and square roots in a fixed order, and no BLAS: the same bits on every
computer.
"""

from collections.abc import Callable
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
#: Returns the difference of values: `heading` needs one that goes around the circle.
Less = Callable[[Any, Any], Any]

#: Share of the covariance by which the curvature of a function counts twice: 2 is right
#: for normal distributions.
BETA = 2.0


class Moments(NamedTuple):
    """Moments of a function whose argument is a belief.

    mean: (m,)      slopes: (k, m), the change for each column of the root
    rest: (m, m), the part of the covariance that no slope explains: its curvature
    """

    mean: Floats
    slopes: Floats
    rest: Floats

    @property
    def covariance(self) -> Floats:
        """(m, m), of the function's values, without the noise of a reading."""
        return product(self.slopes.T, self.slopes) + self.rest


def product(a: Floats, b: Floats) -> Floats:
    """Return the matrix product, the same bits on every computer."""
    found: Floats = (a[:, :, None] * b[None, :, :]).sum(axis=1)
    return found


def points(mean: Floats, root: Floats, alpha: float = 1.0) -> Floats:
    """Return the sigma points (2k + 1, n): the mean first.

    mean: (n,)      root: (n, k)      alpha: 0 to 1, how far they are from the mean
    """
    steps = alpha * sqrt(root.shape[1]) * root.T
    return np.concatenate([mean[None], mean + steps, mean - steps])


def moments(values: Floats, alpha: float = 1.0, less: Less = np.subtract) -> Moments:
    """Return the moments of a function from its values (2k + 1, m) at the points."""
    k = len(values) // 2
    width = alpha * sqrt(k)
    up, down = less(values[1 : k + 1], values[0]), less(values[k + 1 :], values[0])
    slopes, bend = (up - down) / (2 * width), (up + down) / (2 * width)
    shift = bend.sum(axis=0) / width
    rest = product(bend.T, bend)
    rest += (BETA - alpha * alpha) * shift[:, None] * shift
    return Moments(values[0] + shift, slopes, rest)


def predicted(found: Moments, noise: Floats) -> tuple[Floats, Floats]:
    """Return mean and root of the values themselves, with added noise (m, m)."""
    return found.mean, cholesky(found.covariance + noise)


def updated(
    mean: Floats, root: Floats, found: Moments, off: Floats, noise: Floats
) -> tuple[Floats, Floats]:
    """Return mean and root after a reading.

    found: moments of the reading that was expected      off: (m,), the values read,
    less `found.mean`      noise: (m, m), of the reading; its variances are above 0
    """
    low = cholesky(found.rest + noise)
    # Readings that are independent, each with a noise of 1.
    slopes, off = _solved(low, found.slopes.T), _solved(low, off[:, None])[:, 0]
    for j, d in enumerate(slopes):
        s = 1.0 + float((d * d).sum())
        push = (root * d).sum(axis=1)
        mean = mean + push * (off[j] / s)
        root = root - push[:, None] * (d / (s + sqrt(s)))
        shared = (slopes[j + 1 :] * d).sum(axis=1)
        off[j + 1 :] -= shared * (off[j] / s)
        slopes[j + 1 :] -= shared[:, None] * (d / (s + sqrt(s)))
    return mean, root


def distance(found: Moments, off: Floats, noise: Floats) -> float:
    """Return the square of a reading's distance, in standard deviations.

    found, off, noise: as for `updated`
    """
    low = cholesky(found.covariance + noise)
    return float((_solved(low, off[:, None]) ** 2).sum())


def cholesky(matrix: Floats) -> Floats:
    """Return the lower root of a covariance (n, n), which may have variances of 0."""
    left, root = matrix.copy(), np.zeros_like(matrix)
    for j in range(len(matrix)):
        if left[j, j] > 0.0:
            root[j:, j] = left[j:, j] / sqrt(left[j, j])
            left[j:, j:] -= root[j:, j, None] * root[j:, j]
    return root


def _solved(low: Floats, given: Floats) -> Floats:
    """Return x of low @ x = given, for a lower matrix."""
    found = given.copy()
    for j in range(len(low)):
        found[j] /= low[j, j]
        found[j + 1 :] -= low[j + 1 :, j, None] * found[j]
    return found

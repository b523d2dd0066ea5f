"""Kalman: the two filters, which differ in how they try the definition."""

from typing import ClassVar

import numpy as np

from rems_net.maths.ukf import Floats, Less, Moments, moments
from rems_net.processes.estimator import Estimator


class Ukf(Estimator):
    """Estimates a robot's state: the definition is tried as far as the belief goes."""

    def moments(self, values: Floats, less: Less) -> Moments:
        """Return mean, slopes and curvature of the values."""
        return moments(values, self.alpha, less)


class Ekf(Estimator):
    """Estimates a robot's state: the definition counts as straight near the estimate.

    Slopes are differences between points that are 1e-4 deviations from the estimate.
    """

    alpha: ClassVar[float] = 1e-4

    def moments(self, values: Floats, less: Less) -> Moments:
        """Return the value at the mean, and the slopes there."""
        slopes = moments(values, self.alpha, less).slopes
        return Moments(values[0], slopes, np.zeros((slopes.shape[1],) * 2))

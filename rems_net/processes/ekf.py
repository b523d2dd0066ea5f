"""Ekf: an extended Kalman filter, whose slopes come from small differences."""

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from rems_net.maths.ukf import Floats, Moments, moments
from rems_net.processes.estimator import Estimator


class Ekf(Estimator):
    """Estimates a robot's state: the definition counts as straight near the estimate.

    Slopes are differences between points that are 1e-4 deviations from the estimate.
    """

    alpha: ClassVar[float] = 1e-4

    def moments(self, values: Floats, less: Callable[[Any, Any], Any]) -> Moments:
        """Return the value at the mean, and the slopes there."""
        slopes = moments(values, self.alpha, less).slopes
        return Moments(values[0], slopes, np.zeros((slopes.shape[1],) * 2))

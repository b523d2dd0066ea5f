"""Ukf: an unscented Kalman filter, which tries the definition at sigma points."""

from collections.abc import Callable
from typing import Any

from rems_net.maths.ukf import Floats, Moments, moments
from rems_net.processes.estimator import Estimator


class Ukf(Estimator):
    """Estimates a robot's state: the definition is tried as far as the belief goes."""

    def moments(self, values: Floats, less: Callable[[Any, Any], Any]) -> Moments:
        """Return mean, slopes and curvature of the values."""
        return moments(values, self.alpha, less)

"""Learner: tunes a network's weights by an unscented Kalman filter, one pass."""

from collections.abc import Iterable

import numpy as np

from rems_net.drivers.kinematic.correction import Floats, Network
from rems_net.drivers.kinematic.model import POSE
from rems_net.maths.ukf import moments, points, updated

#: Distance of the sigma points, as a share of sqrt(number of weights). Near points miss
#: how curved the network is: at 0.1 the filter is sure of itself too early.
ALPHA = 1.0
#: Share of full speed. Deviation of the first readings, before any is known.
FIRST = 0.1
#: Share of full speed. Readings are never better than this.
LEAST = 1e-2
#: Share by which a new error changes the estimate of the readings' noise.
RATE = 0.02

#: inputs of the network, and what was read: shares of full speed
Sample = tuple[Floats, Floats]


class Learner:
    """Belief about a network's weights: a mean, and a root of the covariance."""

    def __init__(self, network: Network, random: np.random.Generator):
        self.network = network
        self.mean, spread = network.begin(random)
        self.root = np.diag(spread)
        self.noise = np.full(len(POSE), FIRST**2)

    def predict(self, given: Floats) -> Floats:
        """Return the network's results (3,), as shares of full speed."""
        found: Floats = self.network(self.mean[None], given)[0]
        return found

    def learn(self, given: Floats, read: Floats) -> None:
        """Learn from one reading (3,)."""
        if not given.any():
            return  # the result is 0 with any weights
        sigma = points(self.mean, self.root, ALPHA)
        found = moments(self.network(sigma, given), ALPHA)
        off = read - self.predict(given)
        noise = np.diag(self.noise)
        mean, root = updated(self.mean, self.root, found, read - found.mean, noise)
        self.mean, self.root = mean, root
        self.noise = self.noise + RATE * (off * off - self.noise)
        self.noise = np.maximum(self.noise, LEAST**2)


def train(learner: Learner, samples: Iterable[Sample]) -> Learner:
    """Learn from samples, one after the other; a job for a network that is large."""
    for given, read in samples:
        learner.learn(given, read)
    return learner

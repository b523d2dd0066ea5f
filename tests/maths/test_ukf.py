"""The unscented Kalman filter: for a linear system it is the Kalman filter."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from rems_net.maths.ukf import (
    cholesky,
    moments,
    points,
    predicted,
    product,
    updated,
)


def covariance(rng: np.random.Generator, n: int) -> np.ndarray:
    some = rng.normal(size=(n, n))
    return some @ some.T + 0.1 * np.eye(n)


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 6),
    m=st.integers(1, 4),
    alpha=st.sampled_from([0.03, 0.5, 1.0]),
)
def test_of_a_linear_system_it_is_the_kalman_filter(
    seed: int, n: int, m: int, alpha: float
) -> None:
    rng = np.random.default_rng(seed)
    go, look = rng.normal(size=(n, n)), rng.normal(size=(m, n))
    q, r = covariance(rng, n), covariance(rng, m)
    mean, p = rng.normal(size=n), covariance(rng, n)
    ours, root = mean, cholesky(p)
    for _ in range(3):
        mean, p = go @ mean, go @ p @ go.T + q
        sigma = points(ours, root, alpha)
        ours, root = predicted(moments(sigma @ go.T, alpha), q)
        read = rng.normal(size=m)
        s = look @ p @ look.T + r
        gain = p @ look.T @ np.linalg.inv(s)
        mean, p = mean + gain @ (read - look @ mean), p - gain @ s @ gain.T
        found = moments(points(ours, root, alpha) @ look.T, alpha)
        assert found.covariance + r == pytest.approx(s, rel=1e-6, abs=1e-6)
        ours, root = updated(ours, root, found, read - found.mean, r)
    assert ours == pytest.approx(mean, rel=1e-6, abs=1e-6)
    assert root @ root.T == pytest.approx(p, rel=1e-6, abs=1e-6)


def test_the_mean_of_a_square_is_right() -> None:
    """Of x**2 the mean is m**2 + s**2, and the variance 4 m**2 s**2 + 2 s**4."""
    sigma = points(np.array([3.0]), np.array([[0.5]]))
    found = moments(sigma**2)
    assert found.mean == pytest.approx([9.25])
    assert found.covariance == pytest.approx(np.array([[9.125]]))


def test_no_variance_becomes_negative() -> None:
    """After 500 readings that are almost exact, of a curved function."""
    rng = np.random.default_rng(1)
    mean, root = np.ones(3), 10.0 * np.eye(3)
    for _ in range(500):
        x = rng.normal(size=3)
        sigma = points(mean, root, 0.5)
        found = moments((x * sigma**3).sum(axis=1)[:, None], 0.5)
        off = np.array([(x * 8.0).sum()]) - found.mean
        mean, root = updated(mean, root, found, off, np.array([[1e-12]]))
    assert np.isfinite(mean).all()
    assert mean == pytest.approx([2.0, 2.0, 2.0], abs=1e-3)


def test_a_variance_of_nothing_stays() -> None:
    flat = np.diag([4.0, 0.0, 9.0])
    assert product(cholesky(flat), cholesky(flat).T) == pytest.approx(flat)

"""Slips: errors of a drive that grow with speed, beside those of its readings.

A slip is a share by which a command acts more or less in one row. The errors of a
segment are the noise of each reading, and what all slips before it have caused: so they
are not independent of each other. Both sizes come from the residuals of a recording.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rems_net.identification.drive import Floats
from rems_net.identification.fit import Problem
from rems_net.identification.intervals import sandwich, student

#: Number of times that the parts of the errors are weighed anew.
TIMES = 6
#: Least part of an error, as a share of the usual one, squared.
LEAST = 1e-4


@dataclass(frozen=True)
class Errors:
    """Variances of the errors: of each field's readings, and of slips.

    read: (m,), as shares of the fields' usual errors      slip: as a share of 1
    """

    read: Floats
    slip: float

    @classmethod
    def of(cls, problem: Problem, theta: Floats) -> Errors:
        """Return what makes the residuals of a recording most probable."""
        r, _, of_start = problem.slopes(theta, problem.scales(theta))
        m = of_start.shape[2]
        rest = np.linalg.qr(of_start, mode="complete")[0][:, :, m:].transpose(0, 2, 1)
        off = (rest @ r[..., None])[..., 0]
        back = rest.transpose(0, 2, 1)
        parts = [rest @ part @ back for part in _parts(problem, theta)]
        floor = np.full(len(parts), LEAST)
        floor[-1] = LEAST**2
        sizes = np.ones(len(parts))
        sizes[-1] = LEAST
        for _ in range(TIMES):  # Fisher's scoring
            usual = sum(size * part for size, part in zip(sizes, parts, strict=True))
            weight = np.linalg.pinv(usual, hermitian=True)
            seen = (weight @ off[..., None])[..., 0]
            made = [weight @ part for part in parts]
            left = np.array(
                [[np.einsum("sij,sji->", one, two) for one in made] for two in made]
            )
            right = [np.einsum("si,sij,sj->", seen, part, seen) for part in parts]
            found = np.linalg.pinv(left) @ np.array(right)
            sizes = np.maximum(found, floor)
        return cls(sizes[:-1], float(sizes[-1]))

    def widths(self, problem: Problem, theta: Floats) -> Floats:
        """Return half widths (p,) of the intervals to expect, as shares of scales.

        They are computed as those of a fit are, from blocks, with these errors.
        """
        _, of_theta, of_start = problem.slopes(theta, problem.scales(theta))
        q, _ = np.linalg.qr(of_start)
        free = of_theta - q @ (q.transpose(0, 2, 1) @ of_theta)
        # Beforehand, each parameter is known to about itself.
        before = np.eye(len(theta))
        inverse = np.linalg.inv(np.einsum("srp,srq->pq", free, free) + before)
        _, freedom = sandwich(free, np.zeros(free.shape[:2]), inverse)
        pulls = free.reshape(len(free), -1, len(self.read), len(theta))
        read = np.einsum("slfp,slfq,f->pq", pulls, pulls, self.read)
        slips = free.transpose(0, 2, 1) @ _effects(problem, theta)
        spread = before + read + self.slip * np.einsum("spk,sqk->pq", slips, slips)
        points = np.array([student(one) for one in freedom])
        found: Floats = points * np.sqrt(np.diag(inverse @ spread @ inverse))
        return found


def _parts(problem: Problem, theta: Floats) -> list[Floats]:
    """Return covariances (S, R, R) of the errors by size: of fields, and of slips."""
    weight = problem.segments.weight
    one = np.eye(len(problem.sigma))
    rows = weight[:, :, None] * one[:, None, None]  # (m, S, L + 1, m)
    read = [row.reshape(len(weight), -1)[:, :, None] for row in rows]
    slips = _effects(problem, theta)
    whole = np.eye(slips.shape[1])
    return [*(whole * row for row in read), slips @ slips.transpose(0, 2, 1)]


def _effects(problem: Problem, theta: Floats) -> Floats:
    """Return the effects (S, R, K) of a slip of 1 of each command in each row."""
    values = dict(zip(problem.names, theta.tolist(), strict=True))
    found = problem.predictor.shaken(problem.segments, problem.starts, values)
    effects: Floats = problem.shape(found).transpose(1, 2, 0)
    return effects

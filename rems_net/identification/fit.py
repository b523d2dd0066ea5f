"""Fit: parameters by least squares over short predictions, each from a free start.

Where a robot is at the start of each segment is estimated, too, and eliminated from the
equations (variable projection): so an error of a reading costs one segment, and is not
carried along the path. Intervals come from the spread between segments (a sandwich
estimator): errors along a path are not independent of each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rems_net.identification.drive import Drive, Floats
from rems_net.identification.prediction import Predictor, Segments, cut

#: s. Length of a segment.
SEGMENT = 2.0
#: Number of steps of the search.
STEPS = 40
#: Share of a parameter by which it is changed to see its effect.
NUDGE = 1e-5
#: A segment whose error is so many times the median is left out: a jolt, or a wall.
JOLT = 5.0
#: Share of the error that a step of the search must take away: while weights still
#: change, and at the end.
ROUGH, FINAL = 1e-2, 1e-6
#: An error of a field below this share of its spread is a rounding error.
EXACT = 1e-6


@dataclass
class Fit:
    """Parameters that fit, and what is known of them.

    values: by name, in the unit of the parameter
    half: by name, half the width of the 95 % interval, in the same unit
    error: by field, RMS of short predictions against readings, in the field's unit
    segments: number that counted      jolts: times [s] of those that were left out
    blind: relative effect of each direction that the recording does not show
    """

    values: dict[str, float]
    half: dict[str, float] = field(default_factory=dict)
    error: dict[str, float] = field(default_factory=dict)
    segments: int = 0
    jolts: list[float] = field(default_factory=list)
    blind: list[dict[str, float]] = field(default_factory=list)


def fit(
    predictor: Predictor,
    drives: Sequence[Drive],
    begin: Mapping[str, float],
    ranges: Mapping[str, tuple[float, float]],
) -> Fit:
    """Fit the parameters in `begin` to these drives.

    begin: values to begin with      ranges: least and most of each, inclusive
    """
    segments = cut(drives, SEGMENT)
    problem = Problem(predictor, segments, list(begin))
    theta = np.array([*begin.values()], float)
    low = np.array([ranges[name][0] for name in begin])
    high = np.array([ranges[name][1] for name in begin])
    scale = np.maximum(np.abs(theta), 1e-3 * np.minimum(high - low, 1e3))
    keep = np.ones(len(segments))
    for last in (False, False, True):  # weights from the errors of the pass before
        theta = problem.solve(theta, low, high, scale, keep, ROUGH)
        keep = problem.weigh(theta, hard=last)
    theta = problem.solve(theta, low, high, scale, keep, FINAL)
    return problem.report(theta, scale, keep > 0)


class Problem:
    """The equations of a fit: errors of the predictions, and their slopes."""

    def __init__(self, predictor: Predictor, segments: Segments, names: list[str]):
        self.predictor, self.segments, self.names = predictor, segments, names
        self.fields = list(segments.read)
        self.read = np.array([*segments.read.values()])  # (m, S, L + 1)
        self.starts = self.read[:, :, 0].copy()
        self.sigma = np.ones(len(self.fields))
        self.sigma *= self.read.std(axis=2).mean(axis=1) + 1e-9
        self._scales = self.sigma.copy()

    def predict(self, theta: Floats, starts: Floats) -> Floats:
        """Return weighted errors (S, R) of the predictions from these starts (m, S)."""
        return self._shape(self._off(theta, starts))

    def _off(self, theta: Floats, starts: Floats, times: int = 1) -> Floats:
        segments = self.segments
        if times > 1:
            segments = Segments(
                np.tile(segments.begin, times),
                np.tile(segments.steps, (times, 1)),
                {p: np.tile(c, (times, 1)) for p, c in segments.command.items()},
                {p: np.tile(c, (times, 1)) for p, c in segments.read.items()},
                np.tile(segments.weight, (times, 1)),
            )
        by_field = dict(zip(self.fields, starts, strict=True))
        values = dict(zip(self.names, theta.tolist(), strict=True))
        found = self.predictor(segments, by_field, values)
        off: Floats = found - np.tile(self.read, (1, times, 1))
        return off

    def _shape(self, off: Floats) -> Floats:
        times = off.shape[1] // len(self.segments)
        weight = np.tile(self.segments.weight, (times, 1))
        off = off * weight[None] / self.sigma[:, None, None]
        rows: Floats = off.transpose(1, 2, 0).reshape(off.shape[1], -1)
        return rows

    def slopes(self, theta: Floats, scale: Floats) -> tuple[Floats, Floats, Floats]:
        """Return errors (S, R), and slopes by theta and start: (S, R, p), (S, R, m)."""
        m, s = self.starts.shape
        nudged = np.tile(self.starts, (1, m + 1))
        by = 1e-4 * self._scales
        for i in range(m):
            nudged[i, s * (i + 1) : s * (i + 2)] += by[i]
        rows = self._shape(self._off(theta, nudged, m + 1)).reshape(m + 1, s, -1)
        r = rows[0]
        of_start = ((rows[1:] - r) / by[:, None, None]).transpose(1, 2, 0)
        columns = []
        for i in range(len(theta)):
            moved = theta.copy()
            side = NUDGE
            moved[i] += side * scale[i]
            columns.append((self.predict(moved, self.starts) - r) / side)
        of_theta = np.stack(columns, axis=2) if columns else np.zeros((*r.shape, 0))
        return r, of_theta, of_start

    def solve(
        self,
        theta: Floats,
        low: Floats,
        high: Floats,
        scale: Floats,
        keep: Floats,
        least: float,
    ) -> Floats:
        """Return the best parameters within their ranges; `starts` get theirs.

        least: gain of a step, as a share of the error, below which the search ends.
        """
        damping = 1e-6
        r, of_theta, of_start = self.slopes(theta, scale)
        cost = float((keep @ r**2).sum())
        for _ in range(STEPS):
            q, upper = np.linalg.qr(of_start)
            free = of_theta - q @ (q.transpose(0, 2, 1) @ of_theta)
            rest = r - (q @ (q.transpose(0, 2, 1) @ r[..., None]))[..., 0]
            a = np.einsum("s,srp,srq->pq", keep, free, free)
            g = np.einsum("s,srp,sr->p", keep, free, rest)
            damped = a + damping * np.diag(np.diag(a) + 1e-12 * (np.trace(a) + 1e-300))
            step = -np.linalg.lstsq(damped, g, rcond=1e-12)[0] if len(g) else g
            new = np.clip(theta + step * scale, low, high)
            went = (new - theta) / scale
            push = r + of_theta @ went
            moved = -np.linalg.solve(
                upper + 1e-12 * np.eye(upper.shape[-1]),
                q.transpose(0, 2, 1) @ push[..., None],
            )[..., 0]
            before, self.starts = self.starts, self.starts + moved.T
            tried = self.slopes(new, scale)
            cheaper = float((keep @ tried[0] ** 2).sum())
            if not cheaper <= cost:
                self.starts = before
                damping = max(damping * 10, 1e-6)
                if damping > 1e6:
                    break
                continue
            gained = cost - cheaper
            theta, (r, of_theta, of_start), cost = new, tried, cheaper
            damping = max(damping / 10, 1e-12)
            if gained <= least * cost + 1e-15:
                break
        self._slopes = r, of_theta, of_start
        return theta

    def weigh(self, theta: Floats, *, hard: bool) -> Floats:
        """Return the weight of each segment (S,), and weigh fields by their errors.

        A segment with a large error counts less, so that a jolt does not pull the
        parameters towards it; hard: it does not count at all.
        """
        count = self.segments.weight.sum(axis=1)
        off = self._off(theta, self.starts) * self.segments.weight[None]
        each = (off**2).sum(axis=2) / count  # (m, S)
        floor = EXACT * self._scales
        usual = np.maximum(np.median(each, axis=1), floor**2)
        share = np.sqrt((each / usual[:, None]).mean(axis=0))
        kept = share <= JOLT
        if kept.sum() < max(3, len(kept) // 2):
            kept = np.ones(len(kept), bool)
        total = (each[:, kept] * count[kept]).sum(axis=1) / count[kept].sum()
        self.sigma = np.maximum(np.sqrt(total), floor)
        # Of a model that fits, rounding errors are no jolts.
        if not (self.sigma > floor).any():
            return np.ones(len(kept))
        weight: Floats = kept.astype(float) if hard else 1 / (1 + (share / 2) ** 2)
        return weight

    def report(self, theta: Floats, scale: Floats, keep: Any) -> Fit:
        """Return the fit with intervals."""
        r, of_theta, of_start = self.slopes(theta, scale)
        q, _ = np.linalg.qr(of_start)
        free = (of_theta - q @ (q.transpose(0, 2, 1) @ of_theta))[keep]
        rest = (r - (q @ (q.transpose(0, 2, 1) @ r[..., None]))[..., 0])[keep]
        off = self._off(theta, self.starts)[:, keep]
        weight = self.segments.weight[keep]
        rms = np.sqrt((off**2 * weight).sum(axis=(1, 2)) / weight.sum())
        values = dict(zip(self.names, theta.tolist(), strict=True))
        jolts = self.segments.begin[~keep].tolist()
        found = Fit(values, segments=int(keep.sum()), jolts=jolts)
        found.error = dict(zip(self.fields, rms.tolist(), strict=True))
        if len(theta):
            self._intervals(found, free, rest, scale)
        return found

    def _intervals(self, found: Fit, free: Floats, rest: Floats, scale: Floats) -> None:
        s, p = len(free), free.shape[2]
        a = np.einsum("srp,srq->pq", free, free)
        sizes, ways = np.linalg.eigh(a)
        for size, way in zip(sizes, ways.T, strict=True):
            # change of the parameters that moves the predictions by one deviation
            if size <= 1e-10 * sizes[-1] or size < 4.0:
                found.blind.append(
                    {
                        n: float(v)
                        for n, v in zip(self.names, way, strict=True)
                        if abs(v) > 0.2
                    }
                )
        inverse = np.linalg.pinv(a, rcond=1e-10)
        pushes = np.einsum("srp,sr->sp", free, rest)
        spread = inverse @ (pushes.T @ pushes) @ inverse * s / max(s - p, 1)
        wide = student(max(s - p, 1)) * np.sqrt(np.maximum(np.diag(spread), 0)) * scale
        found.half = dict(zip(self.names, wide.tolist(), strict=True))


def student(freedom: int) -> float:
    """Return the 97.5 % point of Student's t, by Cornish and Fisher's expansion."""
    known = {1: 12.706, 2: 4.303, 3: 3.182}
    z, n = 1.959964, float(freedom)
    terms = (
        (z**3 + z) / (4 * n),
        (5 * z**5 + 16 * z**3 + 3 * z) / (96 * n**2),
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * n**3),
    )
    return known.get(freedom, z + sum(terms))

"""Fit: parameters by least squares over short predictions, each from a free start.

Where a robot is at the start of each segment is estimated, too, and eliminated from the
equations (variable projection): so an error of a reading costs one segment, and is not
carried along the path. Intervals come from the spread between segments (a sandwich
estimator): errors along a path are not independent of each other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rems_net.identification.drive import Drive, Floats
from rems_net.identification.intervals import sandwich, student
from rems_net.identification.prediction import Predictor, Segments, cut

#: s. Length of a segment.
SEGMENT = 2.0
#: Number of steps of the search.
STEPS = 40
#: A segment whose error is so many times the median is left out: a jolt, or a wall.
JOLT = 5.0
#: Share of the error that a step of the search must take away: while weights still
#: change, and at the end.
ROUGH, FINAL = 1e-2, 1e-6
#: The same at the end if only a prediction counts.
NEAR = 1e-3
#: Share of the predicted way. A robot that goes less far stood.
STOOD = 0.2
#: Spread of a field that does not move, as a share of the largest one.
STILL = 1e-2
#: Least error of a field, as a share of the largest one; both as shares of the spread.
MUTE = 0.1
#: Share of all effects. A direction with less is not followed.
BLIND = 1e-9
#: An error of a field below this share of its spread is a rounding error.
EXACT = 1e-6


@dataclass
class Fit:
    """Parameters that fit, and what is known of them.

    values: by name, in the unit of the parameter
    half: by name, half the width of the 95 % interval, in the same unit
    error: by field, RMS of short predictions against readings, in the field's unit
    segments: number that counted      jolts: times [s] of those that were left out
    out: their first and last row, among the rows of all drives
    stood: times [s] of those in which the robot stood, but was commanded to go
    begin, late: of each that counted, its time [s], and by how much [s] its readings
    are later than the prediction
    blind: relative effect of each direction that the recording does not show
    """

    values: dict[str, float]
    half: dict[str, float] = field(default_factory=dict)
    error: dict[str, float] = field(default_factory=dict)
    segments: int = 0
    jolts: list[float] = field(default_factory=list)
    out: list[tuple[int, int]] = field(default_factory=list)
    stood: list[float] = field(default_factory=list)
    begin: list[float] = field(default_factory=list)
    late: list[float] = field(default_factory=list)
    blind: list[dict[str, float]] = field(default_factory=list)


def fit(
    predictor: Predictor,
    drives: Sequence[Drive],
    begin: Mapping[str, float],
    ranges: Mapping[str, tuple[float, float]],
    *,
    sure: bool = True,
) -> Fit:
    """Fit the parameters in `begin` to these drives.

    begin: values to begin with      ranges: least and most of each, inclusive
    sure: whether it is a result. If not, only the values are found, from others that
    are near: that takes a third of the time
    """
    segments = cut(drives, SEGMENT)
    problem = Problem(predictor, segments, {name: ranges[name] for name in begin})
    theta = np.array([*begin.values()], float)
    scale = problem.scales(theta)
    keep = np.ones(len(segments))
    # Weights come from the errors of the pass before.
    for last in (False, False, True) if sure else (True,):
        theta = problem.solve(theta, scale, keep, ROUGH)
        keep = problem.weigh(hard=last)
    theta = problem.solve(theta, scale, keep, FINAL if sure else NEAR)
    if not sure:
        return Fit(dict(zip(problem.names, theta.tolist(), strict=True)))
    return problem.report(theta, scale, keep > 0)


class Problem:
    """The equations of a fit: errors of the predictions, and their slopes.

    ranges: least and most of each parameter, inclusive
    """

    def __init__(
        self,
        predictor: Predictor,
        segments: Segments,
        ranges: Mapping[str, tuple[float, float]],
    ):
        self.predictor, self.segments, self.names = predictor, segments, list(ranges)
        self.low = np.array([low for low, _ in ranges.values()])
        self.high = np.array([high for _, high in ranges.values()])
        self.fields = list(segments.read)
        self.read = np.array([*segments.read.values()])  # (m, S, L + 1)
        self.starts = self.read[:, :, 0].copy()
        spread = self.read.std(axis=2).mean(axis=1) + 1e-9
        self._scales = np.maximum(spread, STILL * spread.max())
        self.sigma = self._scales
        #: where the last search has ended: parameters, weights, and slopes there
        self._end: tuple[Floats, Floats, tuple[Floats, Floats, Floats]] | None = None

    def believe(self, error: Mapping[str, float]) -> None:
        """Weigh fields by these errors, each in its field's unit."""
        found = np.array([error[path] for path in self.fields])
        self.sigma = np.maximum(found, EXACT * self._scales)

    def scales(self, theta: Floats) -> Floats:
        """Return the size of each parameter."""
        widths = np.minimum(self.high - self.low, 1e3)
        found: Floats = np.maximum(np.abs(theta), 1e-3 * widths)
        return found

    def _off(self, theta: Floats, starts: Floats) -> Floats:
        """Return the errors (m, K, S, L + 1) of K predictions.

        theta: (K, p)      starts: (m, K, S)
        """
        values = dict(zip(self.names, theta.T, strict=True))
        found = self.predictor.many(self.segments, starts, values)
        off: Floats = found - self.read[:, None]
        return off

    def shape(self, off: Floats) -> Floats:
        """Return weighted errors (K, S, R)."""
        off = off * self.segments.weight / self.sigma[:, None, None, None]
        rows: Floats = off.transpose(1, 2, 3, 0).reshape(*off.shape[1:3], -1)
        return rows

    def slopes(self, theta: Floats, scale: Floats) -> tuple[Floats, Floats, Floats]:
        """Return errors (S, R), and slopes by theta and start: (S, R, p), (S, R, m)."""
        nudged, starts = self.nudges(theta, scale)
        return self.divided(self._off(nudged, starts), theta, scale)

    def nudges(self, theta: Floats, scale: Floats) -> tuple[Floats, Floats]:
        """Return what to predict for the slopes: theta (K, p), and starts (m, K, S)."""
        m, p = len(self.starts), len(theta)
        starts = np.repeat(self.starts[:, None], 1 + m + p, axis=1)
        nudged = np.repeat(theta[None], 1 + m + p, axis=0)
        side = self._sides(theta, scale)
        for i in range(m):
            starts[i, 1 + i] += 1e-4 * self._scales[i]
        for i in range(p):
            nudged[1 + m + i, i] += side[i] * scale[i]
        return nudged, starts

    def divided(
        self, off: Floats, theta: Floats, scale: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return errors and slopes from the errors (m, K, S, L + 1) at the nudges."""
        m, by, side = len(self.starts), 1e-4 * self._scales, self._sides(theta, scale)
        rows = self.shape(off)
        r = rows[0]
        of_start = ((rows[1 : 1 + m] - r) / by[:, None, None]).transpose(1, 2, 0)
        of_theta = ((rows[1 + m :] - r) / side[:, None, None]).transpose(1, 2, 0)
        return r, of_theta, of_start

    def _sides(self, theta: Floats, scale: Floats) -> Floats:
        """Return the nudge of each parameter, away from the end of its range."""
        nudge = self.predictor.nudge
        return np.where(theta + nudge * scale > self.high, -nudge, nudge)

    def _slopes(self, theta: Floats, scale: Floats) -> tuple[Floats, Floats, Floats]:
        """Return slopes; where the last search has ended, they are known."""
        if self._end is None or self._end[0] is not theta:
            return self.slopes(theta, scale)
        _, sigma, (r, of_theta, of_start) = self._end
        ratio = np.tile(sigma / self.sigma, self.read.shape[2])
        return r * ratio, of_theta * ratio[:, None], of_start * ratio[:, None]

    def here(self, theta: Floats) -> Floats:
        """Return the errors (m, S, L + 1) of the predictions with these parameters."""
        return self._off(theta[None], self.starts[:, None])[:, 0]

    def solve(
        self,
        theta: Floats,
        scale: Floats,
        keep: Floats,
        least: float,
    ) -> Floats:
        """Return the best parameters within their ranges; `starts` get theirs.

        least: gain of a step, as a share of the error, below which the search ends.
        """
        damping = 1e-6
        r, of_theta, of_start = self._slopes(theta, scale)
        cost = float((keep @ r**2).sum())
        for _ in range(STEPS):
            q, upper = np.linalg.qr(of_start)
            free = of_theta - q @ (q.transpose(0, 2, 1) @ of_theta)
            rest = r - (q @ (q.transpose(0, 2, 1) @ r[..., None]))[..., 0]
            a = np.einsum("s,srp,srq->pq", keep, free, free)
            g = np.einsum("s,srp,sr->p", keep, free, rest)
            # A direction that does not show stays.
            ridge = BLIND * (np.trace(a) + 1e-300) * np.eye(len(g))
            damped = a + damping * np.diag(np.diag(a)) + ridge
            # A parameter that would leave its range stays at the end of it.
            inside = ~((theta <= self.low) & (g > 0) | (theta >= self.high) & (g < 0))
            step = np.zeros(len(g))
            step[inside] = -np.linalg.solve(damped[np.ix_(inside, inside)], g[inside])
            new = np.clip(theta + step * scale, self.low, self.high)
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
        self._end = theta, self.sigma.copy(), (r, of_theta, of_start)
        return theta

    def weigh(self, *, hard: bool) -> Floats:
        """Return the weight of each segment (S,), and weigh fields by their errors.

        The errors are those where the last search has ended.

        A segment with a large error counts less, so that a jolt does not pull the
        parameters towards it; hard: it does not count at all.
        """
        count = self.segments.weight.sum(axis=1)
        assert self._end is not None
        _, sigma, (r, *_) = self._end
        off = (r.reshape(*self.segments.weight.shape, -1) * sigma).transpose(2, 0, 1)
        each = (off**2).sum(axis=2) / count  # (m, S)
        floor = EXACT * self._scales
        usual = np.maximum(np.median(each, axis=1), floor**2)
        share = np.sqrt((each / usual[:, None]).mean(axis=0))
        kept = share <= JOLT
        if kept.sum() < max(3, len(kept) // 2):
            kept = np.ones(len(kept), bool)
        total = (each[:, kept] * count[kept]).sum(axis=1) / count[kept].sum()
        shares = np.sqrt(total) / self._scales  # none counts for all others
        shares = np.maximum(shares, max(EXACT, MUTE * float(shares.max())))
        self.sigma = shares * self._scales
        # Of a model that fits, rounding errors are no jolts.
        if not (self.sigma > floor).any():
            return np.ones(len(kept))
        weight: Floats = kept.astype(float) if hard else 1 / (1 + (share / 2) ** 2)
        return weight

    def report(self, theta: Floats, scale: Floats, keep: Any) -> Fit:
        """Return the fit with intervals."""
        r, of_theta, of_start = self._slopes(theta, scale)
        q, _ = np.linalg.qr(of_start)
        free = (of_theta - q @ (q.transpose(0, 2, 1) @ of_theta))[keep]
        rest = (r - (q @ (q.transpose(0, 2, 1) @ r[..., None]))[..., 0])[keep]
        off = self.here(theta)
        late = self._late(off, q)[keep]
        stood = self._stood(off) & ~keep
        off = off[:, keep]
        weight = self.segments.weight[keep]
        rms = np.sqrt((off**2 * weight).sum(axis=(1, 2)) / weight.sum())
        values = dict(zip(self.names, theta.tolist(), strict=True))
        jolts = self.segments.begin[~keep].tolist()
        found = Fit(values, segments=int(keep.sum()), jolts=jolts)
        found.error = dict(zip(self.fields, rms.tolist(), strict=True))
        found.out = [self._rows(i) for i in np.flatnonzero(~keep).tolist()]
        found.stood = self.segments.begin[stood].tolist()
        found.begin, found.late = self.segments.begin[keep].tolist(), late.tolist()
        if len(theta):
            self._intervals(found, free, rest, scale)
        return found

    def _rows(self, i: int) -> tuple[int, int]:
        """Return the first and the last row of a segment, among those of all drives."""
        rows = self.segments.rows[i][self.segments.weight[i, 1:] > 0]
        return int(rows[0]) - 1, int(rows[-1])

    def _stood(self, off: Floats) -> Floats:
        """Return whether the robot stood in a segment and was predicted to go, (S,)."""
        apart = max(1, self.read.shape[2] // 4)
        ways = []
        for values in (self.read, self.read + off):
            way = np.abs(values[:, :, apart:] - values[:, :, :-apart])
            way = (way / self._scales[:, None, None]).sum(axis=0)
            ways.append(np.median(way, axis=1))
        stood: Floats = ways[0] < STOOD * ways[1]
        return stood

    def _late(self, off: Floats, q: Floats) -> Floats:
        """Return by how many seconds readings are later than predicted, (S,).

        q: the effects (S, R, m) of the starts, which are eliminated
        """
        step = self.segments.steps.max()
        moves = np.gradient(self.read + off, axis=2) / step
        shifts, r = self.shape(moves[:, None])[0], self.shape(off[:, None])[0]
        shifts -= (q @ (q.transpose(0, 2, 1) @ shifts[..., None]))[..., 0]
        size = (shifts**2).sum(axis=1)
        late: Floats = (shifts * r).sum(axis=1) / (size + 1e-300)
        return late

    def _intervals(self, found: Fit, free: Floats, rest: Floats, scale: Floats) -> None:
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
        spread, freedom = sandwich(free, rest, inverse)
        points = np.array([student(one) for one in freedom])
        wide = points * np.sqrt(spread) * scale
        found.half = dict(zip(self.names, wide.tolist(), strict=True))

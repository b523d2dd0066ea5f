"""Common times of two recordings, and the values of both at these times."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: decimals of a time [s]. Times that differ by less are one time.
DIGITS = 9
#: s. Later times have fewer decimals, so they are compared as they are.
LATE = 1e6
#: fraction of the rows of the recording with fewer rows. If fewer have a common time,
#: values are interpolated.
SHARED = 0.5


@dataclass(frozen=True)
class Common:
    """Common times (n,) s of recordings a and b, and how their rows get there.

    times: of the rows of each.  rows: of each, the row at each common time; none if
    values are interpolated.
    """

    time: Array
    times: tuple[Array, Array]
    rows: tuple[NDArray[np.intp], NDArray[np.intp]] | None

    def of(self, which: int, values: NDArray[np.generic], *, holds: bool) -> Array:
        """Return values (m,) of one recording at the common times (n,).

        holds: whether a value holds until the time of its row, as commands do; others
        are interpolated linearly. Text and truth values hold, too.
        """
        found: Array
        if self.rows is not None:
            found = values[self.rows[which]]  # type: ignore[assignment]
        elif holds or values.dtype.kind not in "fi":
            at = np.searchsorted(self.times[which], self.time - 10**-DIGITS)
            found = values[at]
        else:
            found = np.interp(self.time, self.times[which], values.astype(float))
        return found

    def hidden(self, which: int, values: NDArray[np.generic]) -> float:
        """Return how far interpolated values can be from the true ones.

        See `hidden`. 0 if nothing is interpolated.
        """
        if self.rows is not None:
            return 0.0
        return hidden(self.times[which], values.astype(float))

    def part(self, rows: slice) -> "Common":
        """Return some of these times."""
        some = None
        if self.rows is not None:
            some = self.rows[0][rows], self.rows[1][rows]
        return Common(self.time[rows], self.times, some)


def common(a: Array, b: Array) -> Common:
    """Return the common times of rows at the times `a` and `b` (m,), rising, s.

    If at least half of the rows have a common time, these times; otherwise all times
    of both recordings, as far as both last.
    """
    one, other = _rounded(a), _rounded(b)
    time, i, j = np.intersect1d(one, other, return_indices=True)
    if not len(a) or not len(b):
        return Common(time, (a, b), (i, j))
    first, last = max(one[0], other[0]), min(one[-1], other[-1])
    fewest = min(int(((t >= first) & (t <= last)).sum()) for t in (one, other))
    if first >= last or len(time) >= SHARED * fewest:
        return Common(a[i], (a, b), (i, j))
    every = np.union1d(one, other)
    return Common(every[(every >= first) & (every <= last)], (a, b), None)


def hidden(time: Array, values: Array) -> float:
    """Return a bound of what lies between samples (n,), estimated from the samples.

    Linear interpolation is no further than this from a signal that bends no more
    between the samples than it does from one to the next, or that has one kink there:
    half of the largest change of slope times the longer one of two steps.
    """
    steps = np.diff(time)
    if len(steps) < 2:
        return 0.0
    slopes = np.diff(values) / steps
    bends = np.abs(np.diff(slopes)) * np.maximum(steps[1:], steps[:-1])
    return float(bends.max()) / 2


def laid_at(*settled: float | None) -> float | None:
    """Return the time [s] at which two poses are laid over each other; None for none.

    settled: from when the pose of each counts; None if it does from the start.
    """
    return max((one for one in settled if one is not None), default=None)


def lay(other: Array, one: Array, k: int) -> Array:
    """Return poses (n, 3), moved and turned as a whole, so that they fit in row k."""
    by = one[k, 2] - other[k, 2]
    c, s = np.cos(by), np.sin(by)
    x, y, _ = (other - other[k]).T
    moved = np.stack((c * x - s * y, s * x + c * y, other[:, 2] - other[k, 2]), axis=1)
    return np.asarray(moved + one[k])


def interpolated(hidden: float, unit: str) -> str:
    """Return a remark on values that are interpolated; "" if none is."""
    if not hidden:
        return ""
    size = f"{1e3 * hidden:.2g} mm" if unit == "m" else f"{hidden:.2g} {unit}".strip()
    return f"; interpolated, which can hide {size}"


def _rounded(time: Array) -> Array:
    return np.round(time, DIGITS) if len(time) and time[-1] < LATE else time

"""Motors: what acted in each row of a recording, by lag, delay, dead band and gain.

It is the mean over the row of what `bodies.actuators` makes of the commands, computed
for many values of these parameters at once.
"""

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from rems_net.bodies.actuators import GROUP, followed, shaped
from rems_net.identification.drive import Drive, Floats
from rems_net.maths import exp


def acting(
    drives: Sequence[Drive], fields: Sequence[str], given: Mapping[str, Any]
) -> dict[str, Floats]:
    """Return what acts, by field, (K or 1, rows of all drives), as shares of limits.

    fields: that motors obey      given: the motors' parameters: numbers or (K, 1)
    """
    asked = {
        path: np.concatenate([drive.command[path] for drive in drives])[None]
        for path in drives[0].command
    }
    if not fields:
        return asked
    names = ("lag", "delay", "dead_band")
    lag, delay, band = (np.atleast_2d(given[f"{GROUP}/{name}"]) for name in names)
    gains = {path: np.atleast_2d(given[f"{GROUP}/gain/{path}"]) for path in fields}
    if not (lag.any() or delay.any()):
        return asked | {p: shaped(asked[p], band, gains[p]) for p in fields}
    columns: dict[str, list[Floats]] = {path: [] for path in fields}
    for (rows, times), some in groupby(drives, _times):
        alike, time = [*some], np.frombuffer(times)  # their motors are one array
        moved = [
            shaped(_asked(d, p)[None], band, gains[p]) for p in fields for d in alike
        ]
        means = _means(time, np.stack(np.broadcast_arrays(*moved)), lag, delay)
        means = means[..., len(time) - rows :]
        for path, each in zip(fields, np.split(means, len(fields)), strict=True):
            columns[path].extend(each)
    return asked | {p: np.concatenate(columns[p], axis=1) for p in fields}


def _times(drive: Drive) -> tuple[int, bytes]:
    """Return the number of a drive's rows, and their times, with those of its past."""
    past = [drive.past.time] if drive.past is not None else []
    return len(drive), np.concatenate([*past, drive.time]).tobytes()


def _asked(drive: Drive, path: str) -> Floats:
    """Return what one motor was commanded in these rows."""
    past = [drive.past.command[path]] if drive.past is not None else []
    return np.concatenate([*past, drive.command[path]])


def _means(time: Floats, asked: Floats, lag: Floats, delay: Floats) -> Floats:
    """Return the mean speed in each row, (M, K, n); before the first row motors rest.

    asked: (M, K or 1, n), the command of each of M motors that held until each row's
    time      lag, delay: (K or 1, 1)
    """
    step = np.diff(time, prepend=2 * time[0] - time[1])
    ends = np.concatenate([[time[0] - step[0]], time])
    slow = lag > 0
    rest = exp(-step / np.where(slow, lag, 1.0)) * slow  # (K, n)
    count = max(len(rest), asked.shape[1])
    speed = np.zeros((len(asked), count, len(time) + 1))
    towards = asked * (1.0 - rest)
    for i in range(len(time)):
        speed[..., i + 1] = towards[..., i] + speed[..., i] * rest[:, i]
    _, ways = followed(speed[..., :-1], asked, lag, step)
    way = np.zeros_like(speed)
    np.cumsum(ways, axis=-1, out=way[..., 1:])
    if delay.any():
        when = ends - delay  # (K, n + 1)
        row = np.clip(np.searchsorted(ends, when) - 1, 0, len(time) - 1)
        wide = len(asked), max(len(row), count), row.shape[1]
        rows = np.broadcast_to(row, wide)

        def at(values: Floats) -> Floats:
            every = np.broadcast_to(values, (*wide[:2], values.shape[-1]))
            return np.take_along_axis(every, rows, axis=-1)

        after = np.maximum(when - ends[row], 0.0)
        _, more = followed(at(speed), at(asked), lag, after)
        way = at(way) + more
    means: Floats = np.diff(way, axis=-1) / step
    return means

"""Motors: what acted in each row of a recording, by lag, delay, dead band and gain.

It is the mean over the row of what `bodies.actuators` makes of the commands, computed
for many values of these parameters at once.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rems_net.bodies.actuators import followed, shaped
from rems_net.identification.drive import Drive, Floats
from rems_net.maths import exp


def acting(
    drives: Sequence[Drive], fields: Sequence[str], given: Mapping[str, Any], group: str
) -> dict[str, Floats]:
    """Return what acts, by field, (K or 1, rows of all drives), as shares of limits.

    fields: that motors obey      given: the motors' parameters by `group`/name: numbers
    or (K, 1)
    """
    asked = {
        path: np.concatenate([drive.command[path] for drive in drives])[None]
        for path in drives[0].command
    }
    if not fields:
        return asked
    names = ("lag", "delay", "dead_band")
    lag, delay, band = (np.atleast_2d(given[f"{group}/{name}"]) for name in names)
    for path in fields:
        gain = np.atleast_2d(given[f"{group}/gain/{path}"])
        if not (lag.any() or delay.any()):
            asked[path] = shaped(asked[path], band, gain)
            continue
        columns = []
        for drive in drives:
            time, command = drive.time, drive.command[path]
            if drive.past is not None:
                time = np.concatenate([drive.past.time, time])
                command = np.concatenate([drive.past.command[path], command])
            means = _means(time, shaped(command[None], band, gain), lag, delay)
            columns.append(means[:, len(time) - len(drive) :])
        asked[path] = np.concatenate(columns, axis=1)
    return asked


def _means(time: Floats, asked: Floats, lag: Floats, delay: Floats) -> Floats:
    """Return the mean speed in each row, (K, n); before the first row the motor rests.

    asked: (K or 1, n), the command that held until each row's time      lag: (K, 1)
    """
    step = np.diff(time, prepend=2 * time[0] - time[1])
    ends = np.concatenate([[time[0] - step[0]], time])
    slow = lag > 0
    rest = exp(-step / np.where(slow, lag, 1.0)) * slow  # (K, n)
    count = max(len(rest), len(asked))
    speed = np.zeros((count, len(time) + 1))
    towards = asked * (1.0 - rest)
    for i in range(len(time)):
        speed[:, i + 1] = towards[:, i] + speed[:, i] * rest[:, i]
    _, ways = followed(speed[:, :-1], asked, lag, step)
    way = np.concatenate([np.zeros((count, 1)), np.cumsum(ways, axis=1)], axis=1)
    if delay.any():
        when = ends - delay  # (K, n + 1)
        row = np.clip(np.searchsorted(ends, when) - 1, 0, len(time) - 1)
        row = np.broadcast_to(row, (max(len(row), count), row.shape[1]))

        def at(values: Floats) -> Floats:
            wide = np.broadcast_to(values, (len(row), values.shape[1]))
            return np.take_along_axis(wide, row, axis=1)

        after = np.maximum(when - ends[row], 0.0)
        _, more = followed(at(speed), at(asked), lag, after)
        way = at(way) + more
    means: Floats = np.diff(way, axis=1) / step
    return means

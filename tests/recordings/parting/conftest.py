"""Recordings of robots that part for a reason that is known: it was planted."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from rems_net.recordings.manifest import Manifest, Start
from rems_net.recordings.recording import Recording, read

Array = NDArray[np.float64]
DT, ROWS = 0.05, 160
TIME: Array = np.arange(1.0, ROWS + 1) * DT
POSE = ("state/x [m]", "state/y [m]", "state/heading [rad]")
TOLD = ("command/speed [m/s]", "command/turn [rad/s]")

#: Columns of a robot, by heading, (ROWS,)
Columns = Mapping[str, Array]
Write = Callable[..., Recording]


@pytest.fixture(scope="session")
def write(tmp_path_factory: pytest.TempPathFactory) -> Write:
    """Write a run of these robots, with its manifest, and read it."""

    def run(start: Mapping[str, Array] | None = None, **robots: Columns) -> Recording:
        folder = tmp_path_factory.mktemp("run")
        for name, columns in robots.items():
            table = np.stack((TIME, *columns.values()), axis=1)
            lines = [",".join(map(repr, map(float, row))) for row in table]
            head = ",".join(("time [s]", *columns))
            (folder / f"{name}.csv").write_text("\n".join((head, *lines, "")))
        if start is not None:
            starts = {
                name: Start(0.0, dict(zip(POSE, map(float, pose), strict=True)))
                for name, pose in start.items()
            }
            Manifest("planted", starts).write(folder)
        return read(folder)

    return run


def told(seed: int) -> Array:
    """What a driver says: speeds and turns (ROWS, 2) that change, with pauses."""
    hand = np.random.default_rng(seed)
    spans = hand.uniform((0.05, -1.0), (0.3, 1.0), (8, 2))
    spans[hand.integers(1, 7)] = 0.0
    spans[0, 0] *= np.sign(hand.uniform(-1, 1))
    return np.repeat(spans, ROWS // 8, axis=0)


def drive(
    command: Array,
    start: Array,
    change: Callable[[Array, Array], Array] = lambda steps, time: steps,
) -> dict[str, Array]:
    """What a robot does that is told this, in columns; `change` spoils its steps."""
    steps = change(np.array(command) * DT, TIME)
    way, turn = steps.T
    heading = start[2] + np.cumsum(turn)
    middle = heading - turn / 2
    x = start[0] + np.cumsum(way * np.cos(middle))
    y = start[1] + np.cumsum(way * np.sin(middle))
    columns = (*command.T, x, y, heading)
    return dict(zip((*TOLD, *POSE), columns, strict=True))


def late(points: Columns, by: float, start: Array) -> dict[str, Array]:
    """The same, so much later, s: what it is told comes at once, what it does not."""
    found = dict(points)
    for name, first in zip(POSE, start, strict=True):
        times, values = np.r_[0.0, TIME], np.r_[first, points[name]]
        found[name] = np.interp(TIME - by, times, values)
    return found

"""How far a trajectory is from the class's Webots simulation."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

RECORDING = "Webots02_09_2023_17_17_51.csv"
#: Webots tells the front edge of the board, which is this far ahead of the axle, m.
FRONT_EDGE = 0.01425
#: The robot falls onto its wheels first: it stands at the third row.
SETTLED = 2


def distance_from_webots(
    x: ArrayLike,
    y: ArrayLike,
    heading: ArrayLike,
    webots_rows: Sequence[Mapping[str, float]],
) -> float:
    """Return the RMS distance of the axle from Webots' axle, over all rows, in m.

    x, y (m) and heading (rad) have one element per row: where the axle is at the row's
    timestamp. The trajectory is first laid rigidly over Webots' at the third row.
    """
    ours = np.array([x, y], dtype=float)
    turn = np.array(heading, dtype=float)
    theirs, direction = _axle(webots_rows)
    if ours.shape != theirs.shape or turn.shape != direction.shape:
        raise ValueError(
            f"{theirs.shape[1]} rows of Webots need as many of x, y and heading, "
            f"not {ours.shape[1]}."
        )
    by = direction[SETTLED] - turn[SETTLED]
    rotation = np.array([[np.cos(by), -np.sin(by)], [np.sin(by), np.cos(by)]])
    moved = rotation @ (ours - ours[:, [SETTLED]]) + theirs[:, [SETTLED]]
    return float(np.sqrt(np.mean(np.sum((moved - theirs) ** 2, axis=0))))


def _axle(
    rows: Sequence[Mapping[str, float]],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return Webots' axle (2, n) in m and its heading (n,) in rad, unwrapped."""
    heading = np.unwrap([row["state.th_z"] for row in rows])
    edge = np.array(
        [[row["state.x"] for row in rows], [row["state.y"] for row in rows]]
    )
    ahead = np.array([np.cos(heading), np.sin(heading)])
    return edge - FRONT_EDGE * ahead, heading

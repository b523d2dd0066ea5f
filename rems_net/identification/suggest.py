"""Suggest: which of 20 short drives would show most of a robot's parameters.

A drive is predicted with the parameters as they were found. How its predictions change
with each parameter, as a share of the usual error, is its information (Fisher's); the
best drive makes the volume of all intervals smallest.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from rems_net.identification.drive import Drive, Floats
from rems_net.identification.fit import SEGMENT, Problem
from rems_net.identification.prediction import Predictor, cut, whole

#: s. Length of a suggested drive, and of its rows.
LASTS, ROW = 10.0, 0.1
#: s. Times for which a command holds.
HOLDS = (0.4, 0.7, 1.0, 1.5)
#: Shares of full speed that a side gets, in a random order.
KINDS = {
    "full speed ahead and back": (1.0, -1.0),
    "full speed ahead and back, and rests": (1.0, -1.0, 0.0),
    "full and half speed": (1.0, -1.0, 0.5, -0.5),
    "full speed, and slowly": (1.0, -1.0, 0.2, -0.2),
    "ahead, at full and half speed": (1.0, 0.5),
}


@dataclass(frozen=True)
class Suggestion:
    """A short drive, and what it would show.

    name: in words      drive: its commands, and where they lead
    gain: ratio by which it makes the mean interval narrower
    room: m, the longest way across it
    """

    name: str
    drive: Drive
    gain: float
    room: float

    def __str__(self) -> str:
        return (
            f"{self.name}: {self.drive.time[-1]:.0f} s, intervals {self.gain:.1f} "
            f"times as narrow, in {self.room:.1f} m of room"
        )

    def table(self) -> str:
        """Return the commands as a CSV file that an input plays."""
        paths = list(self.drive.command)
        lines = [",".join(["time [s]", *(f"command/{p} [percent]" for p in paths)])]
        shares = np.array([self.drive.command[path] for path in paths]).T
        for i in range(1, len(shares)):
            if i + 1 == len(shares) or (shares[i] != shares[i + 1]).any():
                numbers = [self.drive.time[i], *100 * shares[i]]
                lines.append(",".join(f"{number:g}" for number in numbers))
        return "\n".join([*lines, ""])


def suggest(
    predictor: Predictor,
    drives: Sequence[Drive],
    values: Mapping[str, float],
    ranges: Mapping[str, tuple[float, float]],
    error: Mapping[str, float],
) -> list[Suggestion]:
    """Return all short drives, the one that shows most first.

    values: of the parameters to know better      ranges: of these
    error: RMS by field of predictions over short pieces, in the field's unit
    drives: those that are known already
    """
    known = information(predictor, drives, values, ranges, error) if drives else 0.0
    # Beforehand, each parameter is known to about itself.
    known = known + np.eye(len(values))
    now = np.linalg.slogdet(known)[1]
    found = []
    for name, one in candidates(list(drives[0].command), predictor):
        drive = _predicted(predictor, one, values)
        more = information(predictor, [drive], values, ranges, error)
        volume = np.linalg.slogdet(known + more)[1] - now
        gain = float(np.exp(volume / 2 / len(values)))
        found.append(Suggestion(name, drive, gain, _room(drive)))
    return sorted(found, key=lambda one: -one.gain)


def candidates(
    fields: Sequence[str], predictor: Predictor
) -> Iterator[tuple[str, Drive]]:
    """Yield short drives by name: each kind of command, held for each of four times."""
    time = np.arange(0.0, LASTS + ROW / 2, ROW)
    rest = predictor.plain.state.schema.paths
    for number, (hold, kind) in enumerate(product(HOLDS, KINDS)):
        random = np.random.default_rng(number)
        command = {path: _held(random, KINDS[kind], hold, len(time)) for path in fields}
        state = {path: np.zeros(len(time)) for path in rest}
        name = f"{kind}, each side for about {hold:g} s"
        yield name, Drive(name, time, command, state)


def _held(
    random: np.random.Generator, shares: Sequence[float], hold: float, rows: int
) -> Floats:
    """Return shares that are held for 0.6 to 1.4 times `hold`; the first row rests."""
    found = [0.0]
    while len(found) < rows:
        share = shares[int(random.integers(len(shares)))]
        found += [share] * max(1, round(hold / ROW * random.uniform(0.6, 1.4)))
    return np.array(found[:rows])


def _predicted(
    predictor: Predictor, drive: Drive, values: Mapping[str, float]
) -> Drive:
    """Return a drive with the state to which its commands lead, from 0."""
    plan = whole(drive)
    went = predictor(plan, plan.starts(), values)[:, 0]
    return replace(drive, state=dict(zip(drive.state, went, strict=True)))


def information(
    predictor: Predictor,
    drives: Sequence[Drive],
    values: Mapping[str, float],
    ranges: Mapping[str, tuple[float, float]],
    error: Mapping[str, float],
) -> Floats:
    """Return the information (p, p) of drives, of shares of the parameters."""
    read = [replace(d, state={p: d.state[p] for p in error}) for d in drives]
    problem = Problem(predictor, cut(read, SEGMENT), {n: ranges[n] for n in values})
    problem.sigma = np.array([*error.values()])
    theta = np.array([*values.values()])
    _, of_theta, of_start = problem.slopes(theta, problem.scales(theta))
    q, _ = np.linalg.qr(of_start)
    free = of_theta - q @ (q.transpose(0, 2, 1) @ of_theta)
    found: Floats = np.einsum("srp,srq->pq", free, free)
    return found


def _room(drive: Drive) -> float:
    """Return the longest way across a drive's path, m; 0 if it has no place."""
    if not {"x", "y"} <= set(drive.state):
        return 0.0
    x, y = (np.ptp(drive.state[path]) for path in ("x", "y"))
    return float(np.hypot(x, y))

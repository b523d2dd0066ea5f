"""Differences of robots of one run, in the fields that they share."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rems_net.recordings.common import common, interpolated
from rems_net.recordings.comparison import factor, until_far

if TYPE_CHECKING:
    from rems_net.recordings.table import Columns

#: pairs. If there are more, each robot is in one only: with the first robot that has
#: its fields.
MANY = 6


@dataclass(frozen=True, repr=False)
class Difference:
    """A field of robot `b` minus that of robot `a`, at the times that both have.

    time (n,) s        values (n,), in the unit of `a`; until one robot runs away
    hidden: what a value can be off by, if values are interpolated; else 0
    """

    a: str
    b: str
    field: str
    unit: str
    time: NDArray[np.float64]
    values: NDArray[np.float64]
    hidden: float = 0.0

    @property
    def rms(self) -> float:
        """Root of the mean square."""
        return float(np.sqrt(np.mean(np.square(self.values))))

    @property
    def final(self) -> float:
        """Value at the last common time."""
        return float(self.values[-1])

    @property
    def most(self) -> float:
        """Largest absolute value."""
        return float(np.abs(self.values).max())

    def __repr__(self) -> str:
        unit = f" {self.unit}" * bool(self.unit)
        return (
            f"{self.a} - {self.b}, {self.field}: {self.rms:.4g}{unit} apart (rms), "
            f"{self.final:.4g}{unit} at the end, {self.most:.4g}{unit} at most"
            f"{interpolated(self.hidden, self.unit)}"
        )


def differences(
    robots: "Sequence[Columns]", posed: Collection[str] = ()
) -> list[Difference]:
    """Compare each two robots in each numeric field of their states that both have.

    posed: robots whose poses are compared instead, if both of a pair are among these
    """
    pairs = [
        (a, b)
        for a, b in combinations(robots, 2)
        if not (a.name in posed and b.name in posed)
    ]
    found: list[Difference] = []
    done: set[str] = set()
    for a, b in pairs:
        if b.name not in done:
            both = _compared(a, b)
            found += both
            done |= {b.name} if both and len(pairs) > MANY else set()
    return found


def _compared(a: "Columns", b: "Columns") -> list[Difference]:
    times = common(a.seconds(), b.seconds())
    found = []
    for field in a if len(times.time) else ():
        by = factor(a, b, field) if field.startswith("state/") else None
        if by is not None:
            values = a.plain(field) * 1.0, by * b.plain(field)
            one, other = (times.of(k, v, holds=False) for k, v in enumerate(values))
            hidden = max(times.hidden(k, v) for k, v in enumerate(values))
            near = until_far(np.stack((one, other)))
            about = a.name, b.name, field, a.unit(field)
            if near:
                off = other[:near] - one[:near]
                found.append(Difference(*about, times.time[:near], off, hidden))
    return found

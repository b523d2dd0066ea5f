"""One step of fabric time. Only the clock makes it."""

from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple, NoReturn


class Tick(NamedTuple):
    """Step number `n`, which covers fabric time (t - dt, t].

    n: 1, 2, 3, ...        t: seconds at the END of the step (`time_of(n, dt)`)
    dt: seconds            pace: real-time factor, 0.0 means as fast as possible
    epoch: of the roster that holds at this tick
    """

    n: int
    t: float
    dt: float
    pace: float = 0.0
    epoch: int = 0

    def _refuse(self, _: object) -> NoReturn:
        raise TypeError(
            "a tick is not a number: tick.t is its time in seconds, tick.n its number, "
            "tick.dt the seconds since the one before (R0512)"
        )

    __mul__ = __add__ = __truediv__ = __sub__ = __rmul__ = _refuse  # type: ignore[misc]

    def __eq__(self, other: object) -> bool:
        if isinstance(other, int | float):
            self._refuse(other)
        return tuple.__eq__(self, other)

    def __hash__(self) -> int:
        return tuple.__hash__(self)

    @property
    def index(self) -> NoReturn:
        """Refuse a method of tuples, which nobody means."""
        raise AttributeError("'Tick' object has no attribute 'index'", obj=self)

    @property
    def count(self) -> NoReturn:
        """Refuse a method of tuples, which nobody means."""
        raise AttributeError("'Tick' object has no attribute 'count'", obj=self)

    def to_plain(self) -> dict[str, Any]:
        """Return the tick as plain data, for the network."""
        return self._asdict()


def time_of(n: int, dt: float) -> float:
    """Return n * dt [s], with dt as the decimal it is written as, rounded once.

    Three steps of 0.1 s end at 0.3 s; the product of floats is 0.30000000000000004.
    """
    p, q = _decimal(dt)
    return n * p / q  # Python divides whole numbers with correct rounding


@lru_cache(maxsize=64)
def _decimal(dt: float) -> tuple[int, int]:
    return Fraction(repr(dt)).as_integer_ratio()

"""Spread: applies a function of one float to numbers and to arrays."""

from collections.abc import Callable
from math import ldexp
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: By this factor, a float is cut into two halves of 26 bits (Veltkamp), whose products
#: are exact.
SPLIT = 134217729.0
#: elements up to which one by one is faster than as an array
FEW = 40


def spread(
    scalar: Callable[..., float], array: Callable[..., Floats], *given: Any
) -> Any:
    """Return `scalar` of numbers, or `array` of arrays, broadcast to one shape.

    Raises TypeError for other values, and for quantities with a unit.
    """
    if all(isinstance(x, int | float | np.number) for x in given):
        return scalar(*map(float, given))
    wide = [_floats(scalar.__name__, x) for x in given]
    if len(wide) > 1:
        wide = [np.array(x) for x in np.broadcast_arrays(*wide)]
    shape, size = wide[0].shape, wide[0].size
    if size > FEW:
        return array(*wide)
    rows = zip(*(x.ravel().tolist() for x in wide), strict=True)
    return np.array([scalar(*row) for row in rows], np.float64).reshape(shape)


def mend(
    result: Floats, where: Bools, scalar: Callable[..., float], *given: Floats
) -> None:
    """Replace the elements for which `array` is not exact by `scalar`'s results."""
    for i in np.flatnonzero(where).tolist():
        result.flat[i] = scalar(*(float(x.flat[i]) for x in given))


def scaled(x: float, k: int) -> float:
    """Return x * 2**k, rounded once; `ldexp` rounds small results by itself."""
    return x * ldexp(1.0, k // 2) * ldexp(1.0, k - k // 2)


def _floats(name: str, x: Any) -> Floats:
    found = np.asarray(x)
    if hasattr(x, "units") or found.dtype.kind not in "fiub":
        raise TypeError(
            f"{name} takes plain numbers and arrays of them, not {x!r:.60}; "
            "an angle is in rad."
        )
    return found.astype(np.float64)

"""atan2 and hypot: from x and y in a plane to the angle and the distance."""

from math import copysign, frexp, inf, isinf, ldexp, nan, sqrt
from typing import Any

import numpy as np

from rems_net.maths.spread import SPLIT, Bools, Floats, mend, scaled, spread

#: pi/2, and its rounding error
QUARTER, QUARTER_TAIL = 1.5707963267948966, 6.123233995736766e-17
#: atan(k / 16), k = 0 to 16, and the rounding error of each
ATAN = (
    (0.0, 0.0),
    (0.06241880999595735, -1.5490756308295046e-18),
    (0.12435499454676144, -3.1253241424539383e-18),
    (0.18534794999569476, 4.180692268843079e-18),
    (0.24497866312686414, 1.0698755618734451e-17),
    (0.3028848683749714, -1.1010827903001369e-17),
    (0.35877067027057225, -2.4623815582638635e-17),
    (0.4124104415973873, -1.587652227770689e-17),
    (0.4636476090008061, 2.2698777452961687e-17),
    (0.5123894603107377, -2.5462781472855804e-17),
    (0.5585993153435624, -5.4556305485916264e-18),
    (0.6022873461349642, 2.950430737228402e-17),
    (0.6435011087932844, 1.5834785051444286e-17),
    (0.6823165548747481, 6.943223671560008e-18),
    (0.7188299996216245, -2.1478388444456983e-17),
    (0.7531512809621944, -2.4256934659182068e-17),
    (0.7853981633974483, 3.061616997868383e-17),
)
#: Numbers between these cannot overflow or underflow here.
SMALL, LARGE = 1e-140, 1e140


def _from(base: int, sign: float) -> list[tuple[float, float]]:
    """Return `base` quarter turns plus `sign` times ATAN, with the rounding errors."""
    start, tail = base * QUARTER, base * QUARTER_TAIL
    made = []
    for high, low in ATAN:
        total = start + sign * high
        missing = (start - total) + sign * high if base else 0.0
        made.append((total, sign * (missing + (tail + sign * low))))
    return made


#: by octant: 0 flat to the right, 1 steep to the right, 2 flat left, 3 steep left
BASES = _from(0, 1.0) + _from(1, -1.0) + _from(2, -1.0) + _from(1, 1.0)
HIGH, LOW = [high for high, _ in BASES], [low for _, low in BASES]
SIGN = [1.0, -1.0, -1.0, 1.0]
HIGHS, LOWS, SIGNS = np.array(HIGH), np.array(LOW), np.array(SIGN)


def atan2(y: Any, x: Any) -> Any:
    """Return the angle of (x, y) from the x axis, counter-clockwise, rad: -pi to pi.

    Zeros, infinities and their signs give the results of IEEE 754.
    """
    if type(y) is not float or type(x) is not float:
        return spread(atan2, _angles, y, x)
    a, b = abs(x), abs(y)
    octant = 2 if x < 0.0 else 0
    if b > a:
        a, b, octant = b, a, octant + 1
    if not (b > SMALL and a < LARGE):
        return _odd_angle(y, x)
    k = int(16.0 * b / a + 0.5)
    at = 17 * octant + k
    angle = HIGH[at] + SIGN[octant] * _small_angle(b, a, k / 16.0, LOW[at])
    return -angle if y < 0.0 else angle


def _small_angle(b: Any, a: Any, c: Any, tail: Any) -> Any:
    """Return atan(b/a) - atan(c) + tail, by the arc tangent of (b - c a) / (a + c b).

    That is at most 1/32, and c has 4 bits. The rounding errors on the way to it are
    computed, and added.
    """
    cut = a * SPLIT
    high = cut - (cut - a)
    low = c * (a - high)
    most = b - c * high
    above = most - low
    above_tail = (most - above) - low
    more = c * b
    below = a + more
    below_tail = (a - below) + more
    t = above / below
    cut = t * SPLIT
    t_high = cut - (cut - t)
    cut = below * SPLIT
    below_high = cut - (cut - below)
    below_low = (below - below_high) + below_tail
    left = (above - t_high * below_high) - t_high * below_low
    t_low = (left + above_tail) / below
    z = t * t
    series = z * (1 / 5 + z * (-1 / 7 + z * (1 / 9 - z / 11)))
    return t_high + (tail + t_low + t * (z * (-1 / 3 + series)))


def _odd_angle(y: float, x: float) -> float:
    """Return atan2 of zeros, infinities, nan, and very large or small numbers."""
    if x != x or y != y:
        return nan
    a, b = abs(x), abs(y)
    if a == inf or b == inf:
        y, x = (copysign(float(isinf(v)), v) for v in (y, x))
        return float(atan2(y, x))
    if b <= a * 2.0**-60:
        if copysign(1.0, x) < 0.0:
            return copysign(2.0 * QUARTER, y)
        return copysign(b / a if a else 0.0, y)
    if a <= b * 2.0**-60:
        return copysign(QUARTER, y)
    up = -frexp(max(a, b))[1]
    return float(atan2(ldexp(y, up), ldexp(x, up)))


def _angles(y: Floats, x: Floats) -> Floats:
    a, b = np.abs(x), np.abs(y)
    steep = b > a
    octant = np.where(x < 0.0, 2, 0) + steep
    a, b = np.where(steep, b, a), np.where(steep, a, b)
    odd: Bools = ~((b > SMALL) & (a < LARGE))
    a, b = np.where(odd, 1.0, a), np.where(odd, 1.0, b)
    k = (16.0 * b / a + 0.5).astype(np.int64)
    at = 17 * octant + k
    angle = HIGHS[at] + SIGNS[octant] * _small_angle(b, a, k / 16.0, LOWS[at])
    result: Floats = np.where(y < 0.0, -angle, angle)
    mend(result, odd, atan2, y, x)
    return result


def hypot(x: Any, y: Any) -> Any:
    """Return the distance of (x, y) from (0, 0).

    The root's error is computed and subtracted (Borges 2019, arXiv:1904.09481).
    """
    if type(x) is not float or type(y) is not float:
        return spread(hypot, _distances, x, y)
    a, b = abs(x), abs(y)
    if b > a:
        a, b = b, a
    if not (b > SMALL and a < LARGE):
        return _odd_distance(a, b)
    h = sqrt(a * a + b * b)
    return h - (_near(h, a, b) if h <= 2.0 * b else _wide(h, a, b)) / (2.0 * h)


def _near(h: Any, a: Any, b: Any) -> Any:
    """Return h*h - a*a - b*b, if h is at most 2 b."""
    d = h - b
    return a * (2.0 * d - a) + (d - 2.0 * (a - b)) * d


def _wide(h: Any, a: Any, b: Any) -> Any:
    """Return h*h - a*a - b*b, if h is more than 2 b."""
    d = h - a
    return 2.0 * d * (a - 2.0 * b) + ((4.0 * d - b) * b + d * d)


def _odd_distance(a: float, b: float) -> float:
    """Return hypot of zeros, infinities, nan, and very large or small numbers."""
    if a == inf or b == inf:
        return inf
    if a != a or b != b:
        return nan
    a, b = max(a, b), min(a, b)
    if b <= a * 2.0**-60:
        return a
    up = -frexp(a)[1]
    return scaled(hypot(ldexp(a, up), ldexp(b, up)), -up)


def _distances(x: Floats, y: Floats) -> Floats:
    a, b = np.abs(x), np.abs(y)
    a, b = np.where(b > a, b, a), np.where(b > a, a, b)
    odd: Bools = ~((b > SMALL) & (a < LARGE))
    a, b = np.where(odd, 1.0, a), np.where(odd, 1.0, b)
    h = np.sqrt(a * a + b * b)
    error = np.where(h <= 2.0 * b, _near(h, a, b), _wide(h, a, b))
    result: Floats = h - error / (2.0 * h)
    mend(result, odd, hypot, x, y)
    return result

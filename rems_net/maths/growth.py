"""exp and log, by the polynomials of fdlibm 5.3 (Sun Microsystems, 1993: e_exp.c,
e_log.c)."""

from math import frexp, inf, nan
from typing import Any

import numpy as np

from rems_net.maths.spread import Floats, mend, scaled, spread

#: Adding and subtracting it rounds to a whole number (1.5 * 2**52).
ROUND = 6755399441055744.0
#: log(2) in two parts; the first has 33 bits
LOG2, LOG2_TAIL = 6.93147180369123816490e-01, 1.90821492927058770002e-10
DOUBLINGS = 1.44269504088896338700e00  # in a growth by e: 1 / log(2)
#: Beyond these, exp is infinite, or 0.
MOST, LEAST = 709.782712893384, -745.1332191019412
#: 0.5**0.5: log is computed for numbers between this and twice this.
HALF_ROOT = 0.7071067811865476

P1, P2 = 1.66666666666666019037e-01, -2.77777777770155933842e-03
P3, P4 = 6.61375632143793436117e-05, -1.65339022054652515390e-06
P5 = 4.13813679705723846039e-08
L1, L2 = 6.666666666666735130e-01, 3.999999999940941908e-01
L3, L4 = 2.857142874366239149e-01, 2.222219843214978396e-01
L5, L6 = 1.818357216161805012e-01, 1.531383769920937332e-01
L7 = 1.479819860511658591e-01


def exp(x: Any) -> Any:
    """Return e to the power of x; infinity beyond 709.78."""
    if type(x) is not float:
        return spread(exp, _exps, x)
    if not LEAST <= x <= MOST:
        return x if x != x else inf if x > 0.0 else 0.0
    doublings = x * DOUBLINGS + ROUND - ROUND
    return scaled(_growth(x, doublings), int(doublings))


def _growth(x: Any, doublings: Any) -> Any:
    """Return exp(x) / 2**doublings."""
    high, low = x - doublings * LOG2, doublings * LOG2_TAIL
    r = high - low
    t = r * r
    c = r - t * (P1 + t * (P2 + t * (P3 + t * (P4 + t * P5))))
    return 1.0 - ((low - (r * c) / (2.0 - c)) - high)


def _exps(x: Floats) -> Floats:
    beyond = ~((x >= LEAST) & (x <= MOST))
    x_near = np.where(beyond, 0.0, x)
    doublings = x_near * DOUBLINGS + ROUND - ROUND
    k = doublings.astype(np.int32)
    growth = _growth(x_near, doublings)
    result: Floats = growth * np.ldexp(1.0, k // 2) * np.ldexp(1.0, k - k // 2)
    mend(result, beyond, exp, x)
    return result


def log(x: Any) -> Any:
    """Return the natural logarithm of x: minus infinity at 0, nan below."""
    if type(x) is not float:
        return spread(log, _logs, x)
    if not 0.0 < x < inf:
        return x if x == inf or x != x else -inf if x == 0.0 else nan
    part, k = frexp(x)
    if part < HALF_ROOT:
        part, k = part + part, k - 1
    return _logarithm(part - 1.0, float(k))


def _logarithm(f: Any, k: Any) -> Any:
    """Return log(2**k * (1 + f))."""
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    r = z * (L1 + w * (L3 + w * (L5 + w * L7))) + w * (L2 + w * (L4 + w * L6))
    half = 0.5 * f * f
    return k * LOG2 - ((half - (s * (half + r) + k * LOG2_TAIL)) - f)


def _logs(x: Floats) -> Floats:
    odd = ~((x > 0.0) & (x < inf))
    part, k = np.frexp(np.where(odd, 1.0, x))
    small = part < HALF_ROOT
    part, k = np.where(small, part + part, part), k - small
    result: Floats = _logarithm(part - 1.0, k.astype(np.float64))
    mend(result, odd, log, x)
    return result

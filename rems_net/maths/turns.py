"""sin, cos and tan of an angle in rad. For infinity and nan they are nan.

An angle is cut into quarter turns and a rest of at most pi/4; sine and cosine of the
rest are polynomials. These, and pi/2 in three parts, are those of fdlibm 5.3 (Sun
Microsystems, 1993: k_sin.c, k_cos.c, e_rem_pio2.c). A rest is the sum `rest + tail`: it
has far more bits than one float.
"""

from functools import cache
from itertools import chain
from typing import Any

import numpy as np

from rems_net.maths.spread import FEW, SPLIT, Floats, mend, spread

#: rad. Angles from this on are reduced with integers of any length.
FAR = 1e6
QUARTERS = 0.6366197723675814  # in a radian: 2/pi
#: Adding and subtracting it rounds to a whole number (1.5 * 2**52).
ROUND = 6755399441055744.0
#: pi/2 in parts; the first two have 33 bits, so 636620 times each is exact
P1 = 1.5707963267341256
P2 = 6.077100506303966e-11
P3 = 2.0222662487959506e-21
#: If rest**2 / quarters**2 is below this, three parts of pi/2 are not enough.
CLOSE = 1e-38

S1, S2 = -1.66666666666666324348e-01, 8.33333333332248946124e-03
S3, S4 = -1.98412698298579493134e-04, 2.75573137070700676789e-06
S5, S6 = -2.50507602534068634195e-08, 1.58969099521155010221e-10
C1, C2 = 4.16666666666666019037e-02, -1.38888888888741095749e-03
C3, C4 = 2.48015872894767294178e-05, -2.75573143513906633035e-07
C5, C6 = 2.08757232129817482790e-09, -1.13596475577881948265e-11

#: The last angle of `sincos`, and its result: a robot's sensors read with the heading
#: with which its next step begins. It is the same object: -0.0 equals 0.0.
_known: tuple[float, tuple[float, float]] = (0.0, (0.0, 1.0))


def sin(x: Any) -> Any:
    """Return the sine of x rad."""
    return sincos(x)[0] if type(x) is float else spread(sin, _sines, x)


def cos(x: Any) -> Any:
    """Return the cosine of x rad."""
    return sincos(x)[1] if type(x) is float else spread(cos, _cosines, x)


def sincos(x: Any) -> tuple[Any, Any]:
    """Return sine and cosine of x rad; for an array hardly slower than one of them."""
    global _known
    if type(x) is float:
        angle, found = _known
        if x is not angle:
            found = _pair(x)
            _known = x, found
        return found
    if type(x) is not np.ndarray or x.dtype != np.float64:
        return sin(x), cos(x)
    if x.size > FEW:
        return _both(x)
    pairs = chain.from_iterable(map(_pair, x.ravel().tolist()))
    both = np.fromiter(pairs, np.float64, 2 * x.size).reshape(-1, 2).T.copy()
    return both[0].reshape(x.shape), both[1].reshape(x.shape)


def tan(x: Any) -> Any:
    """Return the tangent of x rad."""
    if type(x) is not float:
        return spread(tan, _tangents, x)
    quarters, y, tail = _rest(x) if -FAR < x < FAR else _exactly(x)
    if y * y < quarters * quarters * CLOSE:
        quarters, y, tail = _exactly(x)
    if y != y or x == 0.0:  # -0.0, too
        return y
    z = y * y
    sine, cosine = _sine_parts(y, z, tail), _cosine_parts(y, z, tail)
    return -_quotient(cosine, sine) if int(quarters) & 1 else _quotient(sine, cosine)


def _pair(x: float) -> tuple[float, float]:
    """Return sine and cosine of x.

    All in one function, since a call costs as much as six products. Each operation is
    the same as for arrays.
    """
    if -FAR < x < FAR:
        quarters = x * QUARTERS + ROUND - ROUND
        far = x - quarters * P1
        part = quarters * P2
        near = far - part
        part = quarters * P3 - ((far - near) - part)
        y = near - part
        tail = (near - y) - part
        z = y * y
        if z < quarters * quarters * CLOSE:
            quarters, y, tail = _exactly(x)
            z = y * y
    else:
        quarters, y, tail = _exactly(x)
        if y != y:
            return y, y
        z = y * y
    r = z * (C1 + z * (C2 + z * (C3 + z * (C4 + z * (C5 + z * C6)))))
    h = 0.5 * z
    w = 1.0 - h
    cosine = w + (((1.0 - w) - h) + (z * r - y * tail))
    r = S2 + z * (S3 + z * (S4 + z * (S5 + z * S6)))
    v = z * y
    sine = y - ((z * (0.5 * tail - v * r) - tail) - v * S1)
    turn = int(quarters)
    if turn & 1:
        sine, cosine = cosine, -sine
    return (-sine, -cosine) if turn & 2 else (sine, cosine)


def _rest(x: Any) -> tuple[Any, Any, Any]:
    """Return quarter turns, rest and tail of an angle or array below FAR."""
    quarters = x * QUARTERS + ROUND - ROUND
    far = x - quarters * P1
    part = quarters * P2
    near = far - part
    part = quarters * P3 - ((far - near) - part)
    y = near - part
    return quarters, y, (near - y) - part


def _exactly(x: float) -> tuple[float, float, float]:
    """Return quarter turns (mod 4), rest and tail of any float; nan for infinity."""
    if x - x != 0.0:
        return 0.0, x - x, 0.0
    quarter, one = _quarter_turn()
    above, below = x.as_integer_ratio()
    whole = above * (one // below)
    turns = (2 * whole + quarter) // (2 * quarter)
    left = whole - turns * quarter
    y = left / one
    above, below = y.as_integer_ratio()
    return float(turns % 4), y, (left - above * (one // below)) / one


@cache
def _quarter_turn() -> tuple[int, int]:
    """Return pi/2 and 1 in a unit that is small enough for every float (Machin's pi).

    The largest has 1024 bits before the point; no float comes closer to a multiple of
    pi/2 than 2**-62.
    """
    one, guard = 1 << 1280, 64
    scale = one << guard

    def arccot(n: int) -> int:
        term = total = scale // n
        k = 1
        while term:
            term //= -n * n
            k += 2
            total += term // k
        return total

    return (8 * arccot(5) - 2 * arccot(239)) >> guard, one


def _sine_parts(y: Any, z: Any, tail: Any) -> tuple[Any, Any]:
    """Return the sine of a rest as y and a small number to subtract; z: y * y."""
    v = z * y
    r = S2 + z * (S3 + z * (S4 + z * (S5 + z * S6)))
    return y, (z * (0.5 * tail - v * r) - tail) - v * S1


def _cosine_parts(y: Any, z: Any, tail: Any) -> tuple[Any, Any]:
    """Return the cosine of a rest as a number near 1 and a small one to subtract."""
    r = z * (C1 + z * (C2 + z * (C3 + z * (C4 + z * (C5 + z * C6)))))
    h = 0.5 * z
    w = 1.0 - h
    return w, -(((1.0 - w) - h) + (z * r - y * tail))


def _quotient(above: tuple[Any, Any], below: tuple[Any, Any]) -> Any:
    """Return the quotient of two such differences, rounded once or nearly so."""
    a = above[0] - above[1]
    a_tail = (above[0] - a) - above[1]
    b = below[0] - below[1]
    b_tail = (below[0] - b) - below[1]
    q = a / b
    cut = q * SPLIT
    high = cut - (cut - q)
    low = q - high
    cut = b * SPLIT
    b_high = cut - (cut - b)
    b_low = b - b_high
    left = (((a - high * b_high) - high * b_low) - low * b_high) - low * b_low
    return q + ((left + a_tail) - q * b_tail) / b


def _both(x: Floats) -> tuple[Floats, Floats]:
    """Return sine and cosine of an array."""
    far = ~(np.abs(x) < FAR)
    quarters, y, tail = _rest(np.where(far, 0.0, x))
    z = y * y
    sine, less = _sine_parts(y, z, tail)
    sine = sine - less
    cosine, less = _cosine_parts(y, z, tail)
    cosine = cosine - less
    turn = quarters.astype(np.int64)
    odd = turn & 1 == 1
    sines: Floats = np.where(odd, cosine, sine) * (1.0 - (turn & 2))
    cosines: Floats = np.where(odd, sine, cosine) * (1.0 - (turn + 1 & 2))
    rare = far | (z < quarters * quarters * CLOSE)
    if rare.any():
        mend(sines, rare, sin, x)
        mend(cosines, rare, cos, x)
    return sines, cosines


def _sines(x: Floats) -> Floats:
    return _both(x)[0]


def _cosines(x: Floats) -> Floats:
    return _both(x)[1]


def _tangents(x: Floats) -> Floats:
    far = ~(np.abs(x) < FAR)
    quarters, y, tail = _rest(np.where(far, 0.0, x))
    z = y * y
    sine, cosine = _sine_parts(y, z, tail), _cosine_parts(y, z, tail)
    odd = quarters.astype(np.int64) & 1 == 1
    even = _quotient(sine, cosine)
    # If a sine is 0, the number of quarter turns is even.
    sine = np.where(odd, sine[0], 1.0), sine[1]
    result: Floats = np.where(odd, -_quotient(cosine, sine), even)
    result = np.where(x == 0.0, x, result)
    mend(result, far | (z < quarters * quarters * CLOSE), tan, x)
    return result

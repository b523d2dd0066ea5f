"""The same bits everywhere: within 1 ulp of the truth, of numbers and of arrays."""

import importlib
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from rems_net import maths
from rems_net.maths.spread import FEW

mpmath: Any = importlib.import_module("mpmath")
ONE = ("sin", "cos", "tan", "exp", "log")
TWO = ("atan2", "hypot")
SPECIAL = [0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 1e308, -1e308]
SPECIAL += [math.inf, -math.inf, math.nan]
numbers = st.floats(allow_nan=False, allow_infinity=False)
#: whole quarter turns as floats have them, where the rest is almost nothing
quarters = st.integers(-(10**9), 10**9).map(lambda n: n * math.pi / 2)
angles = numbers | st.floats(-1e5, 1e5) | quarters


def truth(name: str, given: Sequence[float]) -> Any:
    # An angle of 2**1023 needs all its bits, and as many of pi.
    with mpmath.workprec(1400):
        exact = [mpmath.mpf(x) for x in given]
        return getattr(mpmath, name)(*exact)


def check(name: str, *given: float) -> None:
    found, true = getattr(maths, name)(*given), truth(name, given)
    assert type(found) is float
    with mpmath.workprec(1400):
        missed = abs(mpmath.mpf(found) - true)
        assert missed < math.ulp(float(true)), (name, given, found)


@given(angles)
@example(6381956970095103 * 2.0**797)  # of all floats, the nearest to a quarter turn
@example(math.pi)
@example(1e22)
def test_turns(x: float) -> None:
    for name in ("sin", "cos", "tan"):
        check(name, x)


@given(numbers | st.floats(-20, 20), numbers | st.floats(-20, 20))
@example(1e-300, 1e300)
@example(5e-324, -5e-324)
def test_the_plane(y: float, x: float) -> None:
    if y:  # the sign of a zero, which decides, mpmath has not
        check("atan2", y, x)
    if math.isfinite(math.hypot(x, y)):
        check("hypot", x, y)


@given(st.floats(-745, 709.7) | st.floats(-1, 1))
@example(-708.5)
@example(709.782712893384)
def test_exp(x: float) -> None:
    check("exp", x)


@given(st.floats(5e-324, 1.7e308) | st.floats(0.5, 2))
def test_log(x: float) -> None:
    check("log", x)


@pytest.mark.parametrize("step", [7, pytest.param(1, marks=pytest.mark.slow)])
def test_a_grid(step: int) -> None:
    for i in range(-2000, 2000, step):
        for name in ("sin", "cos", "tan"):
            check(name, i / 100)
            check(name, i * 53.125)
        check("exp", i / 4)
        check("log", (i + 2001) / 1000)
        check("atan2", math.sin(i / 318), math.cos(i / 318))


@pytest.mark.parametrize("name", ONE)
def test_an_array_has_the_bits_of_its_numbers(name: str) -> None:
    grid = [i * 0.37 for i in range(-2000, 2000)] + [i * math.pi / 2 for i in range(99)]
    far = [1.5**i for i in range(-1000, 1500)]
    function = getattr(maths, name)
    for some in ([*grid, *far, *SPECIAL], SPECIAL, grid[:FEW], [*grid[:FEW], 1.0]):
        found = function(np.array(some))
        assert found.tobytes() == np.array([function(x) for x in some]).tobytes()


@pytest.mark.parametrize("name", TWO)
def test_arrays_have_the_bits_of_their_numbers(name: str) -> None:
    function = getattr(maths, name)
    some = [
        *SPECIAL,
        *(1.7**i for i in range(-400, 400, 7)),
        *(i / 9 for i in range(50)),
    ]
    for these in (some, SPECIAL[:4]):
        a, b = (m.ravel() for m in np.meshgrid(these, these))
        one_by_one = [
            function(x, y) for x, y in zip(a.tolist(), b.tolist(), strict=True)
        ]
        assert function(a, b).tobytes() == np.array(one_by_one).tobytes()


@pytest.mark.parametrize("size", [1, FEW, FEW + 1, 1000])
def test_sine_and_cosine_at_once(size: int) -> None:
    x = np.linspace(-9.0, 2e6, size)
    both = maths.sincos(x)
    assert np.array(both).tobytes() == np.array([maths.sin(x), maths.cos(x)]).tobytes()
    assert maths.sincos(0.5) == (maths.sin(0.5), maths.cos(0.5))


@pytest.mark.parametrize("y", SPECIAL)
@pytest.mark.parametrize("x", SPECIAL)
def test_zeros_infinities_and_signs_in_the_plane(y: float, x: float) -> None:
    for name in TWO:
        found, expected = getattr(maths, name)(y, x), getattr(math, name)(y, x)
        assert repr(found) == repr(expected)


def test_what_has_no_value_is_nan() -> None:
    for name in ("sin", "cos", "tan"):
        for x in (math.inf, -math.inf, math.nan):
            assert math.isnan(getattr(maths, name)(x))
    assert math.isnan(maths.log(-1.0))
    assert maths.log(0.0) == -math.inf
    assert maths.log(math.inf) == maths.exp(710) == math.inf
    assert maths.exp(-math.inf) == maths.exp(-746) == 0.0
    for x in (0.0, -0.0, 5e-324, -5e-324):
        assert repr(maths.sin(x)) == repr(maths.tan(x)) == repr(x)


def test_shapes_and_kinds_of_numbers() -> None:
    assert maths.sin(1) == maths.sin(np.float64(1)) == maths.sin(np.int32(1))
    assert maths.sin(True) == maths.sin(1.0)
    assert maths.cos(np.zeros((3, 40))).shape == (3, 40)
    assert maths.cos(np.zeros((0, 3))).shape == (0, 3)
    assert maths.sin(np.array(1.0)).shape == ()
    assert maths.atan2(np.ones((2, 50)), 2.0).shape == (2, 50)
    assert maths.sin(np.arange(100)).tolist() == [maths.sin(i) for i in range(100)]


def test_what_is_no_plain_number_is_refused() -> None:
    from rems_net.units import deg

    for wrong in ("1", None, 30 * deg, np.array(["1"]), [1j]):
        with pytest.raises(TypeError, match=r"^sin takes plain numbers and arrays"):
            maths.sin(wrong)

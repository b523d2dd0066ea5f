"""Maps from unit to unit, and from range to range: a number in, a number out."""

import importlib
import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from rems_net.defdict.units.table import RELATIVE
from rems_net.defdict.units.unit import find_unit, unyt_unit
from rems_net.errors import UnitError


@dataclass(frozen=True, slots=True)
class Affine:
    """The map x -> (x - sub) * mul / div + add; steps without effect are left out."""

    sub: float = 0.0
    mul: float = 1.0
    div: float = 1.0
    add: float = 0.0

    def __call__(self, x: Any) -> Any:
        """Apply the map to a number or an array."""
        if self.sub:
            x = x - self.sub
        if self.mul != 1.0:
            x = x * self.mul
        if self.div != 1.0:
            x = x / self.div
        return x + self.add if self.add else x

    def code(self, x: str) -> str:
        """Return the same map as an expression of Python."""
        if self.sub:
            x = f"({x} - {self.sub!r})"
        if self.mul != 1.0:
            x = f"{x} * {self.mul!r}"
        if self.div != 1.0:
            x = f"{x} / {self.div!r}"
        return f"{x} + {self.add!r}" if self.add else x

    @property
    def factor(self) -> float:
        """The slope."""
        return self.mul / self.div


@lru_cache(maxsize=4096)
def unit_map(source: str, target: str) -> Affine:
    """Return the map from one unit to another of the same dimension.

    Raises UnitError if the two measure different things. Percent, ratio and
    count need a range and are handled by conversion, except among themselves.
    """
    a, b = find_unit(source), find_unit(target)
    if a.text == b.text:
        return Affine()
    if a.dimension != b.dimension or a.relative != b.relative:
        raise UnitError(
            f"{a.text or 'a plain number'} ({a.measures}) cannot become "
            f"{b.text or 'a plain number'} ({b.measures}). (R0102)"
        )
    if a.relative:
        one, other = RELATIVE[a.text], RELATIVE[b.text]
        if one is None or other is None:
            raise UnitError(f"{a.text} becomes {b.text} only through ranges. (R0102)")
        return Affine(mul=other) if other > one else Affine(div=one)
    try:
        if a.size is not None and b.size is not None:
            made = _exact(a.size / b.size, a.pi - b.pi)
        else:
            made = _ask_unyt(a.text, b.text)
        if made.mul and all(map(math.isfinite, (made.mul, made.div, made.add))):
            return made
    except ArithmeticError:
        pass  # the error below is for this, too, and for a factor of 0 or infinity
    raise UnitError(
        f"{a.text} against {b.text} is too large or too small a factor to "
        f"calculate with. (R0102)"
    )


def _exact(ratio: Fraction, pi: int) -> Affine:
    if pi:
        return Affine(mul=float(ratio) * math.pi**pi)
    if ratio.numerator == 1 and ratio.denominator != 1:
        return Affine(div=float(ratio.denominator))
    return Affine(mul=float(ratio))


def _ask_unyt(source: str, target: str) -> Affine:
    a, b = unyt_unit(source), unyt_unit(target)
    slope = float(a.base_value) / float(b.base_value)
    zero: Any = importlib.import_module("unyt").unyt_quantity(0.0, a)
    return Affine(mul=slope, add=float(zero.to_value(b)))


def between(source: tuple[float, float], target: tuple[float, float]) -> Affine:
    """Return the affine map that takes one range onto another."""
    (a, b), (c, d) = source, target
    if a == -b and c == -d:
        mul, div, a, c = float(d), float(b), 0.0, 0.0
    else:
        mul, div = float(d - c), float(b - a)
    if mul == div:
        mul = div = 1.0
    return Affine(sub=float(a), mul=mul, div=div, add=float(c))

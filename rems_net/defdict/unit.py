"""Units: what one measures, and how to get from one to another.

unyt is the authority. Importing it takes most of a second, so the units that
robots use all day stand in the table below as exact numbers (a fraction and a
power of pi); the tests hold every one of them against unyt. Any other unit is
looked up in unyt the first time it is seen, and each pair is asked for once.
"""

from __future__ import annotations

import importlib
import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from rems_net.errors import UnitError, nearest

# Powers of (length, mass, time, current, temperature, angle), or unyt's own words.
Dimension = tuple[int, ...] | str

NONE: tuple[int, ...] = (0, 0, 0, 0, 0, 0)
DIMENSIONS: dict[str, tuple[int, ...]] = {
    "length": (1, 0, 0, 0, 0, 0),
    "angle": (0, 0, 0, 0, 0, 1),
    "velocity": (1, 0, -1, 0, 0, 0),
    "angular velocity": (0, 0, -1, 0, 0, 1),
    "acceleration": (1, 0, -2, 0, 0, 0),
    "angular acceleration": (0, 0, -2, 0, 0, 1),
    "mass": (0, 1, 0, 0, 0, 0),
    "time": (0, 0, 1, 0, 0, 0),
    "frequency": (0, 0, -1, 0, 0, 0),
    "force": (1, 1, -2, 0, 0, 0),
    "torque": (2, 1, -2, 0, 0, 0),
    "power": (2, 1, -3, 0, 0, 0),
    "voltage": (2, 1, -3, -1, 0, 0),
    "current": (0, 0, 0, 1, 0, 0),
    "resistance": (2, 1, -3, -2, 0, 0),
    "temperature": (0, 0, 0, 0, 1, 0),
    "pressure": (-1, 1, -2, 0, 0, 0),
    "magnetic field": (0, 1, -2, -1, 0, 0),
    "charge": (0, 0, 1, 1, 0, 0),
    "plain number": NONE,
}
_NAMES: dict[Dimension, str] = {
    dimension: name for name, dimension in DIMENSIONS.items()
}

# Units without a size of their own: a value stands for a place in a range.
RELATIVE = {"percent": 100.0, "ratio": 1.0, "count": None}
_SAME = {"%": "percent", "counts": "count", "1": "", "dimensionless": ""}

_TABLE: dict[str, tuple[str, str, int]] = {
    # name: (dimension, exact size in SI, power of pi)
    "m": ("length", "1", 0),
    "mm": ("length", "1/1000", 0),
    "cm": ("length", "1/100", 0),
    "um": ("length", "1/1000000", 0),
    "km": ("length", "1000", 0),
    "inch": ("length", "0.0254", 0),
    "ft": ("length", "0.3048", 0),
    "rad": ("angle", "1", 0),
    "mrad": ("angle", "1/1000", 0),
    "deg": ("angle", "1/180", 1),
    "degree": ("angle", "1/180", 1),
    "rev": ("angle", "2", 1),
    "turn": ("angle", "2", 1),
    "rpm": ("angular velocity", "1/30", 1),
    "s": ("time", "1", 0),
    "ms": ("time", "1/1000", 0),
    "us": ("time", "1/1000000", 0),
    "ns": ("time", "1/1000000000", 0),
    "min": ("time", "60", 0),
    "minute": ("time", "60", 0),
    "hr": ("time", "3600", 0),
    "hour": ("time", "3600", 0),
    "Hz": ("frequency", "1", 0),
    "kHz": ("frequency", "1000", 0),
    "kg": ("mass", "1", 0),
    "g": ("mass", "1/1000", 0),
    "mg": ("mass", "1/1000000", 0),
    "N": ("force", "1", 0),
    "mN": ("force", "1/1000", 0),
    "kN": ("force", "1000", 0),
    "J": ("torque", "1", 0),
    "W": ("power", "1", 0),
    "mW": ("power", "1/1000", 0),
    "kW": ("power", "1000", 0),
    "V": ("voltage", "1", 0),
    "mV": ("voltage", "1/1000", 0),
    "kV": ("voltage", "1000", 0),
    "A": ("current", "1", 0),
    "mA": ("current", "1/1000", 0),
    "uA": ("current", "1/1000000", 0),
    "ohm": ("resistance", "1", 0),
    "K": ("temperature", "1", 0),
    "T": ("magnetic field", "1", 0),
    "mT": ("magnetic field", "1/1000", 0),
    "uT": ("magnetic field", "1/1000000", 0),
    "Pa": ("pressure", "1", 0),
    "kPa": ("pressure", "1000", 0),
    "bar": ("pressure", "100000", 0),
}
_FACTOR = re.compile(r"\s*([A-Za-z]+|1)\s*(?:\*\*\s*(-?\d+))?\s*")
# unyt hands text to sympy, which evaluates it: only names, *, / and small powers
# may get there, for a unit can come from the wire.
_POWER = r"\*\*\s*(?:-?\d{1,2}|\(-?\d{1,2}(?:[./]\d{1,2})?\)|\d?\.\d{1,2})(?![\d.])"
_SAFE = re.compile(rf"(?:[^\W\d]\w*(?!\s*[\w(])|[%°]\w*|1(?![\d.])|{_POWER}|[*/() ])+")
_MAX_TEXT = 64


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit that was found: its text, what it measures, its exact size if known."""

    text: str
    dimension: Dimension
    size: Fraction | None = None
    pi: int = 0

    @property
    def relative(self) -> bool:
        """Whether the unit is a place in a range (percent, ratio, count)."""
        return self.text in RELATIVE

    @property
    def measures(self) -> str:
        """What the unit measures, in a word if there is one."""
        if self.relative:
            return f"share of a range ({self.text})"
        return _NAMES.get(self.dimension, str(self.dimension))


@dataclass(frozen=True, slots=True)
class Affine:
    """The map x -> (x - sub) * mul / div + add, without steps that do nothing."""

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


def tidy(text: str) -> str:
    """Return the one spelling of a unit that is kept and sent."""
    text = text.strip().replace("^", "**").replace("²", "**2").replace("·", "*")
    return _SAME.get(text, text)


@lru_cache(maxsize=1024)
def find_unit(text: str) -> Unit:
    """Return the unit of that name; raise UnitError if nobody knows it."""
    text = tidy(text)
    if text in RELATIVE or text == "":
        return Unit(text, NONE, Fraction(1))
    return _from_table(text) or _from_unyt(text)


def _from_table(text: str) -> Unit | None:
    size, pi, powers, place, sign = Fraction(1), 0, [0] * 6, 0, 1
    while True:
        match = _FACTOR.match(text, place)
        if match is None:
            return None
        name, power = match[1], sign * int(match[2] or 1)
        if name != "1":
            if name not in _TABLE or abs(power) > 8:
                return None
            word, exact, pies = _TABLE[name]
            size *= Fraction(exact) ** power
            pi += pies * power
            for i, one in enumerate(DIMENSIONS[word]):
                powers[i] += one * power
        place = match.end()
        if place == len(text):
            return Unit(text, tuple(powers), size, pi)
        if text[place] not in "*/" or text[place : place + 2] == "**":
            return None
        sign = 1 if text[place] == "*" else -1
        place += 1


def _from_unyt(text: str) -> Unit:
    if len(text) > _MAX_TEXT or not _SAFE.fullmatch(text):
        raise UnitError(f"{text[:_MAX_TEXT]!r} is not written like a unit.")
    unyt = importlib.import_module("unyt")
    try:
        found = unyt.Unit(text)
    except (unyt.exceptions.UnitParseError, SyntaxError, TypeError, ValueError) as why:
        known = (one for one in dir(unyt.unit_symbols) if one[:1].isalpha())
        hint = nearest(text, [*_TABLE, *RELATIVE]) or nearest(text, known, 0.8)
        raise UnitError(f"{text!r} is not a unit that unyt knows.{hint}") from why
    return Unit(text, _dimension(unyt, found))


def _dimension(unyt: Any, unit: Any) -> Dimension:
    base = unyt.dimensions
    order = [base.length, base.mass, base.time, base.current_mks, base.temperature]
    order.append(base.angle)
    powers = unit.dimensions.as_powers_dict()
    if any(one not in order and one != 1 for one in powers):
        return str(unit.dimensions)
    if any(power != int(power) for power in powers.values()):
        return str(unit.dimensions)
    return tuple(int(powers.get(one, 0)) for one in order)


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
            f"{b.text or 'a plain number'} ({b.measures})."
        )
    if a.relative:
        one, other = RELATIVE[a.text], RELATIVE[b.text]
        if one is None or other is None:
            raise UnitError(f"{a.text} becomes {b.text} only through ranges.")
        return Affine(mul=other) if other > one else Affine(div=one)
    if a.size is not None and b.size is not None:
        return _exact(a.size / b.size, a.pi - b.pi)
    return _ask_unyt(a.text, b.text)


def _exact(ratio: Fraction, pi: int) -> Affine:
    if pi:
        return Affine(mul=float(ratio) * math.pi**pi)
    if ratio.denominator == 1:
        return Affine(mul=float(ratio))
    if ratio.numerator == 1:
        return Affine(div=float(ratio.denominator))
    return Affine(mul=float(ratio))


def _ask_unyt(source: str, target: str) -> Affine:
    unyt = importlib.import_module("unyt")
    a, b = unyt.Unit(source), unyt.Unit(target)
    slope = float(a.base_value) / float(b.base_value)
    start = float(unyt.unyt_quantity(0.0, a).to_value(b))
    return Affine(mul=slope, add=start)

"""Unit: what a unit measures, and how large it is.

unyt is the authority. Its import takes most of a second, so the units of `table.py` do
not need it. Any other name is looked up in unyt at its first use.

A unit can come from the wire, and unyt passes text to sympy, which evaluates it. So the
text is parsed here first: unyt only gets names, joined, with one small power each.
"""

import importlib
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from rems_net.defdict.units import table
from rems_net.defdict.units.table import NONE, RELATIVE, TABLE, Dimension
from rems_net.errors import UnitError, nearest

MAX_TEXT, MAX_POWER = 64, 12
_TOKEN = re.compile(
    r"""(?P<name>[^\W\d]\w* | [%°]\w* | 1(?![\d.]))
      | \*\*[ ]*(?P<power>-?\d{1,2} | \d?\.\d{1,2}
                | \([ ]*-?\d{1,2}(?:\.\d{1,2} | /[1-9]\d?)?[ ]*\) )(?![\d.])
      | (?P<sign>[*/()])
      | [ ]+""",
    re.VERBOSE,
)
#: A space that means "times"; and the hour `h`, which unyt writes `hr`.
_BETWEEN = re.compile(r"(?<!^1)(?<=[\w)°%]) +(?=[^\W\d]|[(°%])")
_NAME = re.compile(r"[^\W\d]\w*")
_HOUR = re.compile(r"(?<![\w°%])h(?!\w)")
_SAME = {"%": "percent", "counts": "count", "1": "", "dimensionless": ""}
_NAMES = {dimension: name for name, dimension in table.DIMENSIONS.items()}
Factors = list[tuple[str, Fraction]]


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit that was found: its text, its dimension, its exact size if known."""

    text: str
    dimension: Dimension
    size: Fraction | None = None
    pi: int = 0

    @property
    def relative(self) -> bool:
        """Whether a value is a place in a range (percent, ratio, count)."""
        return self.text in RELATIVE

    @property
    def measures(self) -> str:
        """The quantity that the unit measures, in one word if there is one."""
        if self.relative:
            return f"share of a range ({self.text})"
        if isinstance(self.dimension, str):
            return self.dimension
        return _NAMES.get(self.dimension, str(self.dimension))


def tidy(text: str) -> str:
    """Return the one spelling of a unit that is stored and sent."""
    if not isinstance(text, str):
        raise UnitError(
            f"a unit is text, such as 'mm'; got {text!r}. A value to begin with is "
            f"default={text!r}, and limits are range=(0, 10). (R0103)"
        )
    if len(text) > MAX_TEXT:
        raise _no_unit(text)
    text = text.strip().replace("^", "**").replace("²", "**2").replace("·", "*")
    if " " in text:
        text = _BETWEEN.sub("*", text)  # m s**-1
    if "h" in text:
        text = _HOUR.sub("hr", text)  # km/h
    return _SAME.get(text, text)


def _no_unit(text: str) -> UnitError:
    return UnitError(f"{text[:MAX_TEXT]!r} is not written like a unit. (R0103)")


@lru_cache(maxsize=1024)
def find_unit(text: str) -> Unit:
    """Return the unit of that name; raise UnitError if it is unknown."""
    text = tidy(text)
    if text in RELATIVE or text == "":
        return Unit(text, NONE, Fraction(1))
    if text in table.SHIFTED:
        return Unit(text, table.DIMENSIONS[table.SHIFTED[text]])
    factors = read_factors(text)
    if all(name in TABLE and power.denominator == 1 for name, power in factors):
        return _from_table(text, factors)
    return Unit(text, _dimension(unyt_unit(text)))


def read_factors(text: str) -> Factors:
    """Return the names in a text such as "kg*m**2/(A*s)", each with its power.

    Names are joined by * and /. A name, or a group in parentheses, has at most one
    power. No name has a total power beyond MAX_POWER.
    """
    found: Factors = []
    groups: list[tuple[int, int]] = []  # start of each open group, and its sign
    sign, wanted, last, place = 1, True, -1, 0
    while place < len(text):
        token = _TOKEN.match(text, place)
        if token is None:
            raise _no_unit(text)
        place = token.end()
        name, power, mark = token.group("name", "power", "sign")
        if name:
            if not wanted:
                raise _no_unit(text)
            last, wanted = len(found), False
            found.append((name, Fraction(sign)))
        elif power:
            if last < 0:
                raise _no_unit(text)
            _raise(found, last, Fraction(power.strip("() ")))
            last = -1
        elif mark == "(" and wanted:
            groups.append((len(found), sign))
            sign = 1
        elif mark == ")" and groups and not wanted:
            last, before = groups.pop()
            _raise(found, last, Fraction(before))
        elif mark in ("*", "/") and not wanted:
            sign, wanted, last = 1 if mark == "*" else -1, True, -1
        elif mark:
            raise _no_unit(text)
    if wanted or groups or any(abs(power) > MAX_POWER for _, power in found):
        raise _no_unit(text)
    return [(name, power) for name, power in found if name != "1"]


def _raise(found: Factors, first: int, power: Fraction) -> None:
    found[first:] = [(name, one * power) for name, one in found[first:]]


def _from_table(text: str, factors: Factors) -> Unit:
    size, pi, powers = Fraction(1), 0, [0] * len(NONE)
    for name, power in factors:
        word, exact, pies = TABLE[name]
        size *= Fraction(exact) ** int(power)
        pi += pies * int(power)
        for i, one in enumerate(table.DIMENSIONS[word]):
            powers[i] += one * int(power)
    return Unit(text, tuple(powers), size, pi)


@lru_cache(maxsize=1024)
def unyt_unit(text: str) -> Any:
    """Return the same unit of unyt; raise UnitError if unyt has none."""
    read_factors(text)
    unyt: Any = importlib.import_module("unyt")
    errors = unyt.exceptions
    bad = errors.UnitParseError, errors.InvalidUnitOperation, SyntaxError, ValueError
    try:
        return unyt.Unit(text)
    except (*bad, TypeError, AttributeError, ArithmeticError) as why:
        known = (one for one in dir(unyt.unit_symbols) if one[:1].isalpha())
        hint = _meant(text) or nearest(text, [*TABLE, *RELATIVE])
        hint = hint or nearest(text, known, 0.8)
        raise UnitError(
            f"{text!r} is not a unit that unyt knows.{hint} (R0103)"
        ) from why


def _meant(text: str) -> str:
    """Return a hint at a unit if each name in the text is a common word for one."""
    said = {name: table.SAID.get(name.lower(), name) for name in _NAME.findall(text)}
    if any(one == name and one not in TABLE for name, one in said.items()):
        return ""
    return f" Did you mean {_NAME.sub(lambda name: said[name[0]], text)!r}?"


def _dimension(unit: Any) -> Dimension:
    base = importlib.import_module("unyt").dimensions
    order = [base.length, base.mass, base.time, base.current_mks, base.temperature]
    order.append(base.angle)
    powers = unit.dimensions.as_powers_dict()
    if any(one not in order and one != 1 for one in powers):
        return str(unit.dimensions)
    if any(power != int(power) for power in powers.values()):
        return str(unit.dimensions)
    return tuple(int(powers.get(one, 0)) for one in order)

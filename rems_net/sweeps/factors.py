"""Factors: what differs between the runs of a sweep, and the points to be run."""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from math import prod
from pathlib import Path
from random import Random

from rems_net.errors import ExperimentError
from rems_net.recordings.csv_file import read_text
from rems_net.toml import value_of

_NUMBER = r"[-+]?(?:\d+(?:\.\d+)?|\.\d+)(?:[eE][-+]?\d+)?"
#: `90..130 mm/9`
_RANGE = re.compile(
    rf"\s*(?P<low>{_NUMBER})\s*\.\.\s*(?P<high>{_NUMBER})"
    r"\s*(?P<unit>[^\W\d].*?|%|°)?\s*(?:/\s*(?P<count>\d+))?\s*"
)
#: `90 mm`
_QUANTITY = re.compile(rf"\s*(?P<number>{_NUMBER})\s*(?P<unit>[^\W\d]\S*|%|°)?\s*")
#: parts of a list: commas in quotes or brackets separate nothing
_ITEMS = re.compile(r"""(?:"[^"]*"|'[^']*'|\[[^\]]*\]|\{[^}]*\}|[^,])+""")
#: heading of a column in a list: `robot/sim.track [mm]`
_HEAD = re.compile(r"\s*(\S.*?)\s*(?:\[([^\[\]]+)\])?\s*")
#: a point: name of each factor, and its value
Point = Mapping[str, object]


@dataclass(frozen=True)
class Factor:
    """A setting that differs, `robot/sim.track`, or an agent's class, `robot/sim`.

    values: of a grid or a list.  ends: of a range from which samples are taken, in
    `unit`.
    """

    name: str
    values: Sequence[object] = ()
    ends: tuple[str, str] | None = None
    unit: str = ""

    def at(self, share: float) -> object:
        """Return its value at a share from 0 to 1 of its range, or of its values."""
        if self.ends is None:
            return self.values[int(share * len(self.values))]
        low, high = map(float, self.ends)
        return _with_unit(low + (high - low) * share, self.unit)


def factor(name: str, given: object) -> Factor:
    """Return a factor from `90..130 mm/9`, `90 mm, 110 mm`, one value, or a list.

    Raises ExperimentError.
    """
    given = given.tolist() if hasattr(given, "tolist") else given  # of numpy
    if isinstance(given, list | tuple | range):
        return Factor(name, [*given] or _refuse(name, given))
    if not isinstance(given, str):
        return Factor(name, [given])
    if "..." in given:
        _refuse(name, given)
    if not (found := _RANGE.fullmatch(given)):
        items = [one.strip() for one in _ITEMS.findall(given)]
        return Factor(name, [value_of(one) for one in items] or _refuse(name, given))
    low, high, unit = found["low"], found["high"], found["unit"] or ""
    if found["count"] is None:
        return Factor(name, ends=(low, high), unit=unit)
    if (count := int(found["count"])) < 2:
        _refuse(name, given)
    whole = all(part.lstrip("+-").isdigit() for part in (low, high))
    first, last = Fraction(low), Fraction(high)
    each = [first + (last - first) * i / (count - 1) for i in range(count)]
    whole = whole and all(one.denominator == 1 for one in each)
    return Factor(
        name, [_with_unit(int(n) if whole else float(n), unit) for n in each], unit=unit
    )


def _with_unit(number: float, unit: str) -> object:
    return f"{number!r} {unit}" if unit else number


def _refuse(name: str, given: object) -> Sequence[object]:
    raise ExperimentError(
        f"{name} has the values {given!r:.80}; expected a range with a number of "
        'values, such as "90..130 mm/9", or a list, such as "90 mm, 110 mm". (R1022)'
    )


def points(
    factors: Sequence[Factor], samples: int, listed: Sequence[Point], seed: int
) -> Iterator[Point]:
    """Yield the points of a sweep: of its list, its samples, or its grid.

    samples: number of points of a Latin hypercube, which `seed` draws; 0 for a grid.
    """
    if listed:
        fixed = {one.name: one.values[0] for one in factors}
        yield from ({**fixed, **point} for point in listed)
        return
    rows: Iterator[tuple[object, ...]] = product(*(one.values for one in factors))
    if samples:
        columns = [_strata(one, samples, f"{seed} {one.name}") for one in factors]
        rows = zip(*columns, strict=True)
    names = [one.name for one in factors]
    yield from (dict(zip(names, values, strict=True)) for values in rows)


def _strata(one: Factor, count: int, seed: str) -> list[object]:
    """Return a column of a Latin hypercube: each of `count` equal parts has one."""
    draw = Random(seed).random  # the one method with the same values for ever
    order = sorted((draw(), i) for i in range(count))
    return [one.at((i + draw()) / count) for _, i in order]


def check_points(
    factors: Sequence[Factor], samples: int, listed: Sequence[Point]
) -> int:
    """Return how many points there are. Raises ExperimentError for what cannot be."""
    if any(point.keys() != listed[0].keys() for point in listed):
        raise ExperimentError(
            f"the points of a list have different names ({', '.join(names(listed))}); "
            "give each point all of them. (R1022)"
        )
    ranges = [one.name for one in factors if one.ends]
    many = [one.name for one in factors if len(one.values) > 1 or one.ends]
    if listed and (samples or many):
        raise ExperimentError(
            f"a list of points has them all; leave out {(many or ['samples'])[0]}, or "
            "the list. (R1022)"
        )
    if samples and not many:
        raise ExperimentError(
            "samples are taken from a range, and none is given; type such as "
            "--set robot/sim.track=90..130mm. (R1022)"
        )
    if ranges and not samples:
        raise ExperimentError(
            f"{ranges[0]} has a range without a number of values; type it behind the "
            "range, such as 90..130mm/9, or take samples: --samples 100. (R1022)"
        )
    return len(listed) or samples or prod(len(one.values) for one in factors)


def quantities(values: Sequence[object]) -> tuple[list[object], str]:
    """Return values as plain numbers, and their unit; values without one as they are.

    Of `90 mm` and `0.1 m`, which differ in their units, the text remains.
    """
    texts = [one if isinstance(one, str) else "" for one in values]
    found = [_QUANTITY.fullmatch(one) for one in texts]
    units = {one["unit"] if one else None for one in found}
    if len(units) == 1 and (unit := units.pop()):
        return [float(one["number"]) for one in found if one], unit
    return [*values], ""


def names(listed: Sequence[Point]) -> list[str]:
    """Return the names of the factors of a list of points, in their order."""
    return [*dict.fromkeys(name for point in listed for name in point)]


def listed(path: Path) -> list[Point]:
    """Return the points of a CSV file, one a row; `[mm]` in a heading is a unit.

    Raises ExperimentError.
    """
    first, *rows = csv.reader(read_text(path, path.name).splitlines()) or [[]]
    heads = [_HEAD.fullmatch(one) for one in first]
    if not rows or not all(heads) or any(len(row) != len(first) for row in rows):
        raise ExperimentError(
            f"{path.name} is no list of points; expected a heading such as "
            "'robot/sim.track [mm]', and a row of as many cells for each point. (R1022)"
        )
    return [
        {
            head[1]: value_of(f"{cell} {head[2]}" if head[2] else cell)
            for head, cell in zip(heads, row, strict=True)
            if head
        }
        for row in rows
    ]

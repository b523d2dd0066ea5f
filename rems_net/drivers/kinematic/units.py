"""Units: rates that a definition may not return as numbers without a unit, and why.

Formulas of wheels and sines give SI units. A number without a unit is ambiguous if the
state's field, or a command's that it depends on, has another unit.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np

from rems_net.defdict import DefDict, Schema, parse_quantity
from rems_net.errors import RemsError

#: function that makes a field, by SI unit
SI = {
    "m": "length",
    "m/s": "velocity",
    "m/s**2": "acceleration",
    "rad": "angle",
    "rad/s": "angular_velocity",
    "rad/s**2": "angular_acceleration",
    "kg": "mass",
    "s": "time",
    "Hz": "frequency",
    "N": "force",
    "N*m": "torque",
    "W": "power",
    "V": "voltage",
    "A": "current",
    "Pa": "pressure",
}
#: Shifts of a definition's probes, as a share of each field's limit (of 1 if larger).
PROBES = (0.0, 0.25)


def rate(unit: str) -> str:
    """Return the unit of the rate of a field with this unit."""
    return f"{unit}/s" if unit else "Hz"


def unclear_by_state(state: Schema) -> dict[str, str]:
    """Return, by field, why a number without a unit is ambiguous as its rate."""
    found = {}
    for path, field in state.rows():
        if si := _si_instead_of(unit := field.unit):
            found[path] = (
                f"the state has it in {unit}: that could be in {si}/s or in {unit}/s. "
                f'Write the unit, such as "0.5 {si}/s" or 30 * {_code(unit)} / s, or '
                f"have it in {si}: {SI[si]}()."
            )
    return found


def unclear_by_command(
    rates: Callable[[Any, Any], Mapping[str, Any]], state: DefDict, command: DefDict
) -> dict[str, str]:
    """Return, by field of the state, which field of the command makes a rate ambiguous.

    rates: the definition's `derivative`, called with commands that differ in one field
    only
    """
    found: dict[str, str] = {}
    state, command = probe(state, PROBES[1]), probe(command, PROBES[1])
    for name, field in command.schema.rows():
        if field.shape or not (si := _si_instead_of(field.unit)):
            continue
        other = command.copy()
        other[name] = probe(command, PROBES[1])[name]
        if other == command:  # the value was at its limit already
            other[name] = command.schema()[name]
        for path, unit in _moved(rates, state, command, other):
            found.setdefault(
                path,
                f"{name!r} of the command, on which it depends, is a number in "
                f"{field.unit}. Have {name!r} in {si}: {SI[si]}(), to which commands "
                f'are converted; or return the rate with its unit, such as "0.5 '
                f'{rate(unit)}" or command["{name}"] * {_code(field.unit)}.',
            )
    return found


def _moved(
    rates: Callable[[Any, Any], Mapping[str, Any]],
    state: DefDict,
    command: DefDict,
    other: DefDict,
) -> Iterator[tuple[str, str]]:
    """Yield fields whose rates differ as numbers without unit, and their units."""
    try:
        one, two = dict(rates(state, command)), dict(rates(state, other))
    except Exception:  # a definition may fail here; a real command reports it
        return
    for path, value in one.items():
        if _plain(value) and _plain(two.get(path)) and value != two[path]:
            yield path, getattr(state.schema.find(path), "unit", "")


def probe(value: DefDict, by: float) -> DefDict:
    """Return a copy, each field shifted by a share of its upper limit, or of 1."""
    copy = value.copy()
    for path, field in zip(value.schema.paths, value.schema.fields, strict=True):
        if field.dtype == "float" and not field.shape:
            low, high = field.limits
            moved = value[path] + by * min(high, 1.0)
            copy[path] = float(min(max(moved, low), high))
    return copy


@lru_cache(maxsize=256)
def _si_instead_of(unit: str) -> str:
    """Return the SI unit for a unit's quantity; "" if the unit is that itself."""
    for si in SI:
        with suppress(RemsError):
            return "" if parse_quantity(f"1 {si}", unit) == 1.0 else si
    return ""


def _code(unit: str) -> str:
    """Return a unit as Python code for names of `rems_net.units`."""
    return (
        unit.replace("**", "^")
        .replace("/", " / ")
        .replace("*", " * ")
        .replace("^", "**")
    )


def _plain(value: object) -> bool:
    return type(value) in (int, float, np.float64)

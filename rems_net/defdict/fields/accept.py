"""Accept: check a value for a field.

`accept` turns a value that a user assigns into the one form that is stored: a plain
Python float, int, bool, str or bytes, a read-only array, or a tuple of DefDicts. This
is the slow path: a float inside its limits never gets here.
"""

import math
import re
import sys
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from rems_net.defdict.fields.descriptions import (
    expected,
    is_quantity,
    perhaps,
    refuse,
    show,
)
from rems_net.defdict.fields.kind import Kind
from rems_net.defdict.units.maps import Affine, between, unit_map
from rems_net.defdict.units.table import RELATIVE
from rems_net.defdict.units.unit import MAX_TEXT, find_unit, tidy
from rems_net.errors import FieldValueError, UnitError, nearest, uncoded

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(.*)", re.DOTALL)


def accept(field: Kind, value: Any, where: str) -> Any:
    """Return the value as the field stores it; raise an error that names the field."""
    if field.shape:
        return _array(field, value, where)
    if field.numeric:
        return _number(field, value, where)
    if field.dtype == "bool":
        if isinstance(value, bool | np.bool_):
            return bool(value)
        raise refuse(field, where, value, " Write True or False.")
    if field.dtype == "choice":
        if isinstance(value, str) and value in field.choices:
            return str(value)
        raise refuse(field, where, value, nearest(value, field.choices))
    if field.dtype == "str":
        if isinstance(value, str) and _utf8(value) <= field.max_len:
            return str(value)
        group = isinstance(value, Mapping)
        hint = " Write it as text in quotes: 'heading = 0.1, x = 2'." if group else ""
        raise refuse(field, where, value, hint)
    if field.dtype == "bytes":
        if isinstance(value, bytes | bytearray) and len(value) <= field.max_len:
            return bytes(value)
        raise refuse(field, where, value)
    return _items(field, value, where)


def _utf8(text: str) -> int:
    try:
        return len(text.encode())
    except UnicodeEncodeError:
        return sys.maxsize


def _number(field: Kind, value: Any, where: str) -> float | int:
    kind, came = type(value), value
    if kind is not float and kind is not int:
        value = in_unit(field, value, where)
    if field.whole:
        if isinstance(value, float):
            raise refuse(field, where, value, _whole_hint(value))
        value = int(value)
    else:
        try:
            value = float(value)
        except OverflowError as why:
            raise refuse(field, where, came) from why
    low, high = field.limits
    if not low <= value <= high:
        finite = field.whole or math.isfinite(value)
        asked = perhaps(field, value) if kind in (int, float) else ""
        limit = " To limit it, use clip()." if finite else ""
        raise refuse(field, where, came, asked + limit)
    number: float | int = value
    return number


def in_unit(field: Kind, value: Any, where: str) -> Any:
    """Return a number, a text or a quantity as a number in the field's unit."""
    if isinstance(value, str):
        return _from_text(field, value, where)
    if is_quantity(value):
        return _from_quantity(field, value, where)
    if isinstance(value, np.generic) and value.dtype.kind in "iuf":
        return value.item()
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise refuse(field, where, value, _hint(value))
    return value


def _hint(value: object) -> str:
    if isinstance(value, bool):
        return f" Write {int(value)} if you mean the number."
    if isinstance(value, Mapping):
        return " It is one value, not a group of fields."
    return ""


def _whole_hint(value: float) -> str:
    if not math.isfinite(value):
        return ""
    return f" Write {round(value)}." if value == round(value) else " Use round()."


def split_text(text: str) -> tuple[float, str] | None:
    """Split "250 mm" into (250.0, "mm"); None if it does not begin with a number."""
    match = _QUANTITY.fullmatch(text)
    if match is None or len(match[2].strip()) > MAX_TEXT:
        return None
    return float(match[1]), tidy(match[2].strip())


def _from_text(field: Kind, text: str, where: str) -> float | int:
    found = split_text(text)
    unit = field.unit
    if found is None:
        example = f'1.5 or "1.5 {unit}"' if unit else "1.5"
        raise refuse(field, where, text, f" Type a number, such as {example}.")
    number, given = found
    if re.match(r",\d+(?![.,\d])", given):
        point = text.strip().replace(",", ".", 1)
        raise refuse(field, where, text, f' Write a decimal point: "{point}".')
    if not given:
        if asked := perhaps(field, number):
            raise refuse(field, where, text, asked)
        more = f' with its unit: "{number:g} {unit}"' if unit else ""
        raise refuse(
            field,
            where,
            text,
            f" Type {number:g} without quotes{', or' + more if more else ''}.",
        )
    return _to_unit(field, number, given, where, text)


def _from_quantity(field: Kind, value: Any, where: str) -> float | int:
    if hasattr(value, "is_Unit"):
        value = 1.0 * value
    if value.ndim:
        raise refuse(field, where, value, " It is one value, not several.")
    return _to_unit(field, float(value.value), unit_text(value.units), where, value)


@lru_cache(maxsize=256)
def unit_text(unit: Any) -> str:
    """Return a unit of unyt as text. unyt itself would take 60 us each time."""
    return str(unit)


def _to_unit(
    field: Kind, number: float, unit: str, where: str, got: object
) -> float | int:
    found = float(to_unit(field, unit, where, got)(number))
    return int(found) if field.whole and found.is_integer() else found


def to_unit(field: Kind, unit: str, where: str, got: object) -> Affine:
    """Return the map from a unit to the field's own, percent of the range included."""
    try:
        unit = tidy(unit)
        if unit == "" and field.unit == "ratio":
            return Affine()
        own = field.relative and field.unit != "count"
        if find_unit(unit).relative and unit != field.unit and not own:
            return _share(field, unit)
        return unit_map(unit, field.unit)
    except UnitError as why:
        sample = (
            f' Type a number in {field.unit}, or a text such as "1.5 {field.unit}".'
        )
        raise UnitError(
            f"{where} expects {expected(field)}, but got {show(got)}: {uncoded(why)}"
            f"{sample if field.unit else ''} (R0102)"
        ) from why


def _share(field: Kind, unit: str) -> Affine:
    full = RELATIVE[unit]
    if field.range is None or full is None:
        raise UnitError(
            f"{unit} is a share of a range, and this field has "
            f"{'no range' if full else 'another unit'}. (R0102)"
        )
    low, high = field.range
    return between((0.0 if low == 0 else -full, full), (low, high))


def _array(field: Kind, value: Any, where: str) -> np.ndarray[Any, Any]:
    if is_quantity(value):
        value = to_unit(field, str(value.units), where, value)(np.asarray(value.value))
    if isinstance(value, list | tuple) and str in map(type, value):
        element = Kind("float", field.unit, field.range)
        value = [_number(element, one, where) for one in value]
    try:
        found = np.asarray(value)
    except (ValueError, TypeError) as why:
        raise refuse(field, where, value) from why
    if found.shape != field.shape:
        raise refuse(
            field, where, value, f" Its shape is {found.shape}, not {field.shape}."
        )
    if field.whole and found.dtype.kind == "f":
        off = (found < field.limits[0]) | (found > field.limits[1])
        if off.any():
            raise _refuse_element(field, where, found, off)
    wanted = {"f": "iuf", "b": "b", "i": "iu", "u": "iu"}[field.dtype[0]]
    if found.dtype.kind not in wanted:
        raise refuse(field, where, value, f" Its elements are {found.dtype}.")
    if field.dtype != "bool":
        low, high = field.limits
        good = (found >= low) & (found <= high)
        if not good.all():
            raise _refuse_element(field, where, found, ~good)
    stored = np.array(found, dtype=field.element, order="C")
    stored.flags.writeable = False
    return stored


def _refuse_element(
    field: Kind, where: str, found: np.ndarray[Any, Any], bad: Any
) -> FieldValueError:
    at = tuple(int(i) for i in np.argwhere(bad)[0])
    place = f"{where}[{', '.join(map(str, at))}]"
    hint = " To limit it, use clip()." if np.isfinite(found[at]) else ""
    element = Kind("float", field.unit, field.range)
    return refuse(element, place, found[at].item(), hint)


def _items(field: Kind, value: Any, where: str) -> tuple[Any, ...]:
    item = field.item
    if item is None or isinstance(value, str | bytes | Mapping):
        raise refuse(field, where, value)
    try:
        given = list(value)
    except TypeError as why:
        raise refuse(field, where, value) from why
    if len(given) > field.max_len:
        raise refuse(field, where, value, f" It has {len(given)} items.")
    return tuple(item._build(one, f"{where}[{i}]") for i, one in enumerate(given))


def many_turns(value: object, unit: str) -> str:
    """Return how to write an angle that a person may mean in degrees; "" for others.

    Those are beyond a turn, without a unit; computed ones have more digits.
    """
    plain = type(value) is int or (type(value) is float and round(value, 3) == value)
    if unit != "rad" or not plain or not abs(value) > 2 * math.pi:  # type: ignore[arg-type]
        return ""
    return (
        f"{value / (2 * math.pi):.1f} turns, since it is in rad; write "  # type: ignore[operator]
        f'"{value:g} deg", or "{value:g} rad" if you mean that'
    )


def parse_quantity(value: Any, unit: str, where: str = "the value") -> float:
    """Return a number, or a text such as "0.1 s", as a float in `unit`.

    Raises FieldValueError or UnitError; the message begins with `where`.
    """
    return float(accept(Kind("float", tidy(unit)), value, where))

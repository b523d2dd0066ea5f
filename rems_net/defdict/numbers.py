"""A DefDict as numbers: arrays, quantities, limits, and text that shows units."""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rems_net.defdict.accept import accept, is_quantity, show, split_text, to_unit
from rems_net.defdict.field import Field
from rems_net.defdict.glob import matching
from rems_net.defdict.schema import Schema
from rems_net.errors import FieldValueError, UnknownFieldError

if TYPE_CHECKING:
    from rems_net.defdict.value import DefDict


def _rows(value: DefDict) -> list[tuple[str, Field, Any]]:
    schema = value.schema
    return list(zip(schema.paths, schema.fields, value.leaves(), strict=True))


def _field(value: DefDict, path: str) -> Field:
    found = value.schema[path]
    if not isinstance(found, Field):
        raise UnknownFieldError(f"{value.schema.name}: {path!r} is a group of fields.")
    return found


# -- limits -------------------------------------------------------------------


def clip(value: DefDict, given: Mapping[str, Any]) -> dict[str, Any]:
    """Set each field to the nearest value in its range; return what was kept."""
    asked = dict(_spread(value.schema, given, ""))
    for path, number in asked.items():
        field = _field(value, path)
        if field.numeric:
            where = f"{value.schema.name}: {path!r}"
            asked[path] = _limited(field, number, where)
    value.update(asked)
    return {path: value[path] for path in asked}


def _spread(
    schema: Schema, given: Mapping[str, Any], prefix: str
) -> Iterator[tuple[str, Any]]:
    """Yield path and value of groups and globs field by field."""
    for key, number in given.items():
        path = prefix + key
        if "*" in path:
            found = matching(path, schema.paths)
            if not found:
                raise schema.unknown(path)
            yield from ((one, number) for one in found)
        elif isinstance(schema[path], Schema) and isinstance(number, Mapping):
            yield from _spread(schema, number, f"{path}/")
        else:
            yield path, number


def _limited(field: Field, number: Any, where: str) -> Any:
    """Return a number in the field's unit, limited; arrays element by element."""
    low, high = field.limits
    wide = Field("float", field.unit) if not field.shape else None
    if wide is None:
        if is_quantity(number):
            number = to_unit(field, str(number.units), where, number)(number.value)
        found = np.asarray(number)
        if found.dtype.kind == "f" and np.isnan(found).any():
            raise FieldValueError(f"{where} has no nearest value to NaN.")
        return np.clip(found, low, high)
    if is_quantity(number) or isinstance(number, str):
        text = str(number) if isinstance(number, str) else ""
        unit = split_text(text) if text else (float(number.value), str(number.units))
        if unit and unit[1]:
            number = to_unit(field, unit[1], where, number)(unit[0])
    if isinstance(number, float | np.floating) and math.isinf(number):
        return high if number > 0 else low
    if field.whole and isinstance(number, float | np.floating):
        number = round(accept(wide, number, where))
    found = number if field.whole else accept(wide, number, where)
    if isinstance(found, int | float | np.integer) and not isinstance(found, bool):
        return min(max(found, low), high)
    return found


# -- arrays -------------------------------------------------------------------


def to_array(value: DefDict, column: bool = False) -> np.ndarray[Any, Any]:
    """Return all numbers in schema order as float64."""
    parts = []
    for path, field, leaf in _rows(value):
        if not (field.numeric or field.dtype == "bool"):
            raise FieldValueError(
                f"{value.schema.name}: {path!r} is {field.dtype}, not a number; take "
                f"a schema of the numbers first: schema.slice(...)."
            )
        parts.append(np.ravel(np.asarray(leaf, dtype=np.float64)))
    flat = np.concatenate(parts) if parts else np.empty(0)
    return flat.reshape(-1, 1) if column else flat


def from_array(value: DefDict, numbers: Any) -> None:
    """Set all fields from numbers in schema order; all, or (if one is bad) none."""
    found = np.asarray(numbers)
    size = sum(field.size for field in value.schema.fields)
    if found.shape not in ((size,), (size, 1)):
        raise FieldValueError(
            f"{value.schema.name} has {size} numbers: it takes an array of shape "
            f"({size},) or ({size}, 1), not {found.shape}."
        )
    flat, first, given = found.ravel(), 0, {}
    for path, field, _ in _rows(value):
        part = flat[first : first + field.size]
        first += field.size
        given[path] = _back(field, part)
    value.update(given)


def _back(field: Field, part: np.ndarray[Any, Any]) -> Any:
    if field.dtype == "bool" or field.whole:
        rounded = np.rint(part)
        if np.array_equal(rounded, part):
            kind = bool if field.dtype == "bool" and set(part) <= {0, 1} else int
            part = rounded.astype(kind)
    return part.reshape(field.shape) if field.shape else part[0].item()


# -- units --------------------------------------------------------------------


def quantity(value: DefDict, path: str) -> Any:
    """Return one field as a quantity of unyt."""
    field = _field(value, path)
    if not field.numeric:
        raise FieldValueError(f"{value.schema.name}: {path!r} is {field.dtype}.")
    unyt = importlib.import_module("unyt")
    unit = field.unit if field.unit not in ("", "ratio") else "dimensionless"
    make = unyt.unyt_array if field.shape else unyt.unyt_quantity
    return make(value[path], unit)


def with_units(value: DefDict) -> dict[str, Any]:
    """Return path to quantity; a field without a unit stays as it is."""
    return {
        path: quantity(value, path) if field.numeric and field.unit else leaf
        for path, field, leaf in _rows(value)
    }


# -- text ---------------------------------------------------------------------


def describe(value: DefDict) -> dict[str, dict[str, Any]]:
    """Return {path: {"value": ..., "unit": ...}} of what JSON can hold."""
    found = {}
    for path, field, leaf in _rows(value):
        shown: Any = leaf
        if field.shape:
            shown = leaf.tolist()
        elif field.dtype == "bytes":
            shown = leaf.hex()
        elif field.dtype == "list":
            shown = [describe(item) for item in leaf]
        found[path] = {"value": shown, "unit": field.unit}
    return found


def _text(field: Field, leaf: Any) -> str:
    if field.dtype == "list":
        return f"[{', '.join(one_line(item) for item in leaf)}]"
    if field.shape:
        return f"{show(leaf.tolist())}{field.unit and ' ' + field.unit}"
    if field.numeric:
        return f"{leaf!r}{field.unit and ' ' + field.unit}"
    return show(leaf)


def one_line(value: DefDict) -> str:
    """Return the value in one line, with units."""
    inside = ", ".join(f"{path}={_text(field, x)}" for path, field, x in _rows(value))
    return f"{value.schema.name}({inside})"


def lines(value: DefDict) -> str:
    """Return the value with one field a line, with units."""
    rows = _rows(value)
    width = max((len(path) for path, _, _ in rows), default=0)
    return "\n".join(
        [
            value.schema.name,
            *(f"  {path:{width}}  {_text(field, x)}" for path, field, x in rows),
        ]
    )

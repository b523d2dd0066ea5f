"""Limiting: the nearest value that a field takes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rems_net.defdict.fields.accept import accept, split_text, to_unit
from rems_net.defdict.fields.kind import Kind
from rems_net.defdict.fields.words import is_quantity
from rems_net.defdict.trees.paths import matching
from rems_net.defdict.trees.tree import Tree
from rems_net.errors import FieldValueError


def spread(
    tree: Tree, given: Mapping[str, Any], prefix: str
) -> Iterator[tuple[str, Any]]:
    """Yield path and value of groups and globs field by field."""
    for key, number in given.items():
        path = prefix + key
        if "*" in path:
            found = matching(path, tree.paths)
            if not found:
                raise tree.unknown(path)
            yield from ((one, number) for one in found)
        elif isinstance(tree[path], Tree) and isinstance(number, Mapping):
            yield from spread(tree, number, f"{path}/")
        else:
            yield path, number


def limited(field: Kind, number: Any, where: str) -> Any:
    """Return a number in the field's unit, limited; arrays element by element."""
    low, high = field.limits
    if field.shape:
        if is_quantity(number):
            number = to_unit(field, str(number.units), where, number)(number.value)
        found = np.asarray(number)
        if found.dtype.kind == "f" and np.isnan(found).any():
            raise FieldValueError(f"{where} has no nearest value to NaN.")
        return np.clip(found, low, high)
    wide = Kind("float", field.unit)
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

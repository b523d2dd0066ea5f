"""Describe: build a tree from its description, which may come from any sender."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from rems_net.defdict.fields.descriptions import show
from rems_net.defdict.fields.field import Field
from rems_net.defdict.trees.tree import FORMAT, MAX_FIELDS
from rems_net.errors import RemsError, WireError
from rems_net.packing import UNPACK_ERRORS, unpack

MAX_WIRE = 1 << 20
T = TypeVar("T")
_BAD: tuple[type[Exception], ...] = (RemsError, KeyError, *UNPACK_ERRORS)


def from_wire(payload: bytes, make: Callable[[str, dict[str, Field]], T]) -> T:
    """Make a tree from its description; raise WireError on anything else."""
    if len(payload) > MAX_WIRE:
        raise WireError(f"a schema of {len(payload)} bytes is over {MAX_WIRE}. (R0122)")
    try:
        found = unpack(payload, longest_list=MAX_FIELDS, largest_map=16)
        return _tree(found, make, 0)
    except WireError:
        raise
    except _BAD as why:
        raise WireError(
            f"this is not the description of a schema: {why} (R0122)"
        ) from why


def _tree(found: Any, make: Callable[[str, dict[str, Field]], T], depth: int) -> T:
    if not isinstance(found, dict) or set(found) != {"rems", "name", "fields"}:
        raise WireError(
            "the description of a schema is a map of 'rems', 'name' and "
            "'fields'. (R0122)"
        )
    if found["rems"] != FORMAT or type(found["rems"]) is not int:
        raise WireError(
            f"the schema is written in format {found['rems']!r}; this version of "
            f"rems_net reads format {FORMAT}. (R0122)"
        )
    if depth > 4 or not isinstance(found["fields"], list):
        raise WireError(
            "in the description of a schema, the fields are a list, "
            "nested four times at most. (R0122)"
        )
    entries: dict[str, Field] = {}
    for row in found["fields"]:
        if not isinstance(row, list) or len(row) != 3 or row[0] in entries:
            raise WireError(
                "in the description of a schema, a field is [path, dtype, "
                f"properties], once; got {show(row)}. (R0122)"
            )
        entries[row[0]] = _field(row[1], row[2], make, depth)
    return make(found["name"], entries)


_TYPES: dict[str, tuple[type, ...]] = {
    "unit": (str,),
    "range": (list,),
    "default": (float, int, bool, str, bytes, list),
    "shape": (list,),
    "max_age": (float,),
    "choices": (list,),
    "table": (list,),
    "means": (str,),
    "max_len": (int,),
    "doc": (str,),
    "item": (dict,),
}


def _field(dtype: Any, found: Any, make: Callable[..., Any], depth: int) -> Field:
    if not isinstance(dtype, str) or not isinstance(found, dict):
        raise WireError(
            "in the description of a schema, a field is [path, dtype, "
            "properties]. (R0122)"
        )
    for key, value in found.items():
        if type(value) not in _TYPES.get(key, ()):
            raise WireError(
                "in the description of a schema, a field has no property "
                f"{show(key)} of {show(value)}. (R0122)"
            )
    given = dict(found)
    for key in ("range", "shape", "choices"):
        if key in given:
            given[key] = tuple(given[key])
    for one in given.get("range", ()):
        if type(one) not in (int, float):
            raise WireError(
                "in the description of a schema, a range is two numbers, not "
                f"{given['range']!r}. (R0122)"
            )
    if "item" in given:
        given["item"] = _tree(given["item"], make, depth + 1)
    default = given.get("default")
    if given.get("shape") and default is not None:
        if not isinstance(default, bytes):
            raise WireError(
                "in the description of a schema, the default of an array is "
                "bytes. (R0122)"
            )
        given["default"] = np.frombuffer(
            default, np.dtype(dtype).newbyteorder("<")
        ).reshape(given["shape"])
    elif dtype in ("float", "int") and isinstance(default, str | bytes | list):
        raise WireError(
            "in the description of a schema, the default of a number is a "
            "number. (R0122)"
        )
    return Field(dtype, **given)

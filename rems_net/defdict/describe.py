"""A schema in words: its digest, its form on the wire, and its table for people.

On the wire a schema is one msgpack map: `{"rems": 1, "name": ..., "fields": [...]}`,
each field `[path, dtype, {only what differs from the ordinary}]`, in schema order.
The digest hashes the same fields sorted by path, without names and docs: it is
equal where values mean the same.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from rems_net.defdict.compare import same
from rems_net.defdict.field import Field, _zero
from rems_net.defdict.packing import UNPACK_ERRORS, pack, unpack
from rems_net.defdict.schema import MAX_FIELDS, Schema
from rems_net.errors import RemsError, SchemaError, WireError

FORMAT = 1
MAX_WIRE = 1 << 20
_BAD: tuple[type[Exception], ...] = (RemsError, KeyError, *UNPACK_ERRORS)


def properties(field: Field) -> dict[str, Any]:
    """Return what differs from an ordinary field, as plain msgpack values."""
    found: dict[str, Any] = {}
    if field.unit:
        found["unit"] = field.unit
    if field.range is not None:
        found["range"] = list(field.range)
    if not same(field.default, _zero(field)):
        found["default"] = plain(field, field.default)
    if field.shape:
        found["shape"] = list(field.shape)
    if field.max_age is not None:
        found["max_age"] = float(field.max_age)
    if field.choices:
        found["choices"] = list(field.choices)
    if field.table:
        found["table"] = [list(point) for point in field.table]
    if field.means:
        found["means"] = field.means
    if field.dtype in ("str", "bytes", "list"):
        found["max_len"] = field.max_len
    if field.doc:
        found["doc"] = field.doc
    return found


def plain(field: Field, value: Any) -> Any:
    """Return a stored value as msgpack takes it."""
    if field.shape:
        return value.tobytes()
    if field.dtype == "list":
        return [item.to_wire_map() for item in value]
    return value


def _fields(schema: Schema, canonical: bool) -> list[Any]:
    rows = []
    for path, field in zip(schema.paths, schema.fields, strict=True):
        found = properties(field)
        if canonical:
            found.pop("doc", None)
        if field.functions is not None:
            found["functions"] = True
        if field.item is not None:
            found["item"] = _fields(field.item, True) if canonical else _map(field.item)
        rows.append([path, field.dtype, dict(sorted(found.items()))])
    return sorted(rows, key=lambda row: row[0]) if canonical else rows


def _map(schema: Schema) -> dict[str, Any]:
    return {"rems": FORMAT, "name": schema.name, "fields": _fields(schema, False)}


def identity(schema: Schema) -> tuple[object, ...]:
    """Return what makes two schemas equal."""
    functions = tuple(one.functions for one in schema.fields if one.functions)
    return pack(_map(schema)), functions


def digest(schema: Schema) -> str:
    """Return the digest of what the values of a schema mean."""
    return hashlib.sha256(pack([FORMAT, _fields(schema, True)])).hexdigest()[:16]


def to_wire(schema: Schema) -> bytes:
    """Return the description of a schema; raise SchemaError if it cannot travel."""
    for path, field in zip(schema.paths, schema.fields, strict=True):
        if field.functions is not None:
            raise SchemaError(
                f"{schema.name}: {path!r} is read through Python functions, which "
                f"cannot be sent. Give count() a table=, or convert before sending."
            )
    return pack(_map(schema))


def from_wire(payload: bytes) -> Schema:
    """Build a schema from its description; raise WireError on anything else."""
    if len(payload) > MAX_WIRE:
        raise WireError(f"a schema of {len(payload)} bytes is over {MAX_WIRE}.")
    try:
        found = unpack(payload, longest_list=MAX_FIELDS, largest_map=16)
        return _schema(found, 0)
    except WireError:
        raise
    except _BAD as why:
        raise WireError(f"this is not the description of a schema: {why}") from why


def _schema(found: Any, depth: int) -> Schema:
    if not isinstance(found, dict) or set(found) != {"rems", "name", "fields"}:
        raise WireError("a schema is a map of 'rems', 'name' and 'fields'.")
    if found["rems"] != FORMAT or type(found["rems"]) is not int:
        raise WireError(
            f"the schema is written in format {found['rems']!r}; this version of "
            f"rems_net reads format {FORMAT}."
        )
    if depth > 4 or not isinstance(found["fields"], list):
        raise WireError("the fields of a schema are a list, nested four times at most.")
    entries: dict[str, Field] = {}
    for row in found["fields"]:
        if not isinstance(row, list) or len(row) != 3 or row[0] in entries:
            raise WireError(f"a field is [path, dtype, properties], once; got {row!r}.")
        entries[row[0]] = _field(row[1], row[2], depth)
    return Schema(found["name"], entries)


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


def _field(dtype: Any, found: Any, depth: int) -> Field:
    if not isinstance(dtype, str) or not isinstance(found, dict):
        raise WireError("a field is [path, dtype, properties].")
    for key, value in found.items():
        if not isinstance(value, _TYPES.get(key, ())):
            raise WireError(f"a field has no property {key!r} of {value!r}.")
    given = dict(found)
    for key in ("range", "shape", "choices"):
        if key in given:
            given[key] = tuple(given[key])
    for one in given.get("range", ()):
        if type(one) not in (int, float):
            raise WireError(f"a range is two numbers, not {given['range']!r}.")
    if "item" in given:
        given["item"] = _schema(given["item"], depth + 1)
    default = given.get("default")
    if given.get("shape") and default is not None:
        if not isinstance(default, bytes):
            raise WireError("the default of an array is bytes.")
        given["default"] = np.frombuffer(
            default, np.dtype(dtype).newbyteorder("<")
        ).reshape(given["shape"])
    elif dtype in ("float", "int") and isinstance(default, str | bytes | list):
        raise WireError("the default of a number is a number.")
    return Field(dtype, **given)


def table(schema: Schema) -> str:
    """Return the table of a schema for people."""
    rows = [("field", "type", "unit", "range", "default", "")]
    for path, field in zip(schema.paths, schema.fields, strict=True):
        limits = f"{field.range[0]:g} to {field.range[1]:g}" if field.range else ""
        default = "" if field.shape or field.dtype == "list" else f"{field.default!r}"
        row = (path, field.describe_type(), field.unit, limits, default, field.doc)
        rows.append(row)
    return f"{schema.name}@{schema.digest}\n{columns(rows)}"


def columns(rows: Sequence[tuple[str, ...]]) -> str:
    """Return rows as aligned columns."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  " + "  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )

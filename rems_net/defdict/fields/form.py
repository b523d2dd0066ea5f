"""A field as msgpack, as it stands in the description of a schema.

`dtype, {only what differs from the ordinary}`, the properties by name. What a field
*means* is the same without its doc.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rems_net.defdict.fields.kind import Kind
from rems_net.packing import map_header, pack


def _properties(field: Kind) -> dict[str, Any]:
    """Return what differs from an ordinary field, as plain msgpack values."""
    found: dict[str, Any] = {}
    if field.choices:
        found["choices"] = list(field.choices)
    if field.shape:
        if not np.array_equal(field.default, field.zero):
            found["default"] = field.default.tobytes()
    elif field.dtype == "list" and field.default:
        found["default"] = [item.to_wire_map() for item in field.default]
    elif field.default != field.zero:
        found["default"] = field.default
    if field.doc:
        found["doc"] = field.doc
    if field.functions is not None:
        found["functions"] = True
    if field.item is not None:
        found["item"] = field.item
    if field.max_age is not None:
        found["max_age"] = field.max_age
    if field.dtype in ("str", "bytes", "list"):
        found["max_len"] = field.max_len
    if field.means:
        found["means"] = field.means
    if field.range is not None:
        found["range"] = list(field.range)
    if field.shape:
        found["shape"] = list(field.shape)
    if field.table:
        found["table"] = [list(point) for point in field.table]
    if field.unit:
        found["unit"] = field.unit
    return found


def forms(field: Kind) -> tuple[bytes, bytes]:
    """Return the description of a field, and its meaning."""
    found = _properties(field)
    described = pack(field.dtype) + _packed(found, meaning=False)
    if not field.doc and field.item is None:
        return described, described
    found.pop("doc", None)
    return described, pack(field.dtype) + _packed(found, meaning=True)


def _packed(found: dict[str, Any], *, meaning: bool) -> bytes:
    item = found.get("item")
    if item is None:
        return pack(found)
    parts = [map_header(len(found))]
    for key, value in found.items():
        parts.append(pack(key))
        if key == "item":
            parts.append(item.meaning if meaning else item.description)
        else:
            parts.append(pack(value))
    return b"".join(parts)

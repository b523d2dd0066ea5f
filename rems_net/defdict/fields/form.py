"""A field as msgpack, as it stands in the description of a schema.

`dtype, {only what differs from the ordinary}`, the properties by name. What a field
*means* is the same without its doc.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rems_net.defdict.fields.kind import Kind
from rems_net.packing import map_header, pack

_NAMES = ["choices", "default", "doc", "functions", "item", "max_age", "max_len"]
_NAMES += ["means", "range", "shape", "table", "unit"]


def forms(field: Kind) -> tuple[bytes, bytes]:
    """Return the description of a field, and its meaning."""
    found = {name: getattr(field, name) for name in _NAMES}
    found["default"] = _default(field)
    found["functions"] = True if field.functions else None
    if field.dtype not in ("str", "bytes", "list"):
        del found["max_len"]
    found = {key: one for key, one in found.items() if one not in (None, "", ())}
    described = pack(field.dtype) + _packed(found, meaning=False)
    if not field.doc and field.item is None:
        return described, described
    found.pop("doc", None)
    return described, pack(field.dtype) + _packed(found, meaning=True)


def _default(field: Kind) -> Any:
    """Return the default as msgpack takes it; None for the ordinary one."""
    if field.shape:
        ordinary = np.array_equal(field.default, field.zero)
        return None if ordinary else field.default.tobytes()
    if field.dtype == "list":
        return tuple(item.to_wire_map() for item in field.default)
    return None if field.default == field.zero else field.default


def _packed(found: dict[str, Any], *, meaning: bool) -> bytes:
    item = found.get("item")
    if item is None:
        return pack(found)
    inside = item.meaning if meaning else item.description
    rows = (pack(k) + (inside if k == "item" else pack(v)) for k, v in found.items())
    return map_header(len(found)) + b"".join(rows)

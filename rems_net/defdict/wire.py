"""The payload of a schema: one msgpack map, field to value, in schema order.

A schema of floats, booleans and arrays always has the same length, and between the
values always the same bytes; its codec is one `struct` call each way, which was
measured at a third of the time of msgpack for the same bytes. Everything else
(text, whole numbers, lists, and bytes from other encoders) goes through msgpack and
is checked field by field.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import Any

import msgpack
import numpy as np

from rems_net.defdict.accept import accept, show
from rems_net.defdict.field import Field
from rems_net.defdict.schema import Schema
from rems_net.errors import FieldValueError, WireError, nearest

Leaves = list[Any]
_HEAD = 5  # the longest header of a msgpack string, array or map


class Codec:
    """Encode and decode the leaves of one schema; `source` is the compiled code."""

    encode: Callable[[Leaves], bytes]
    decode: Callable[[bytes], Leaves]

    def __init__(self, schema: Schema) -> None:
        self.schema = schema
        self.max_size = _longest(schema)
        self.max_list = _most(schema)
        self.max_map = max(_widest(schema), 1)
        self.pack = msgpack.Packer().pack
        if schema.fields and all(map(_fixed, schema.fields)):
            self.source, names = _fixed_code(schema)
        else:
            self.source, names = _open_code(schema)
        names.update(slow=self.decode_slow, pack=names.get("pack", self.pack))
        exec(compile(self.source, f"<codec of {schema.name}>", "exec"), names)
        self.encode = names["encode"]
        self.decode = names["decode"]

    def decode_slow(self, payload: bytes) -> Leaves:
        """Decode through msgpack and check everything; raise WireError."""
        name = self.schema.name
        if not isinstance(payload, bytes | bytearray | memoryview):
            raise WireError(f"{name}: a payload is bytes, not {show(payload)}.")
        if len(payload) > self.max_size:
            raise WireError(
                f"{name}: {len(payload)} bytes came; its longest payload "
                f"has {self.max_size}."
            )
        try:
            found = msgpack.unpackb(
                payload,
                object_pairs_hook=_pairs,
                max_array_len=self.max_list,
                max_map_len=self.max_map,
                max_ext_len=0,
            )
        except (ValueError, TypeError, msgpack.UnpackException) as why:
            text = str(why) or type(why).__name__
            raise WireError(
                f"{name}: the payload is not one msgpack map: {text}"
            ) from why
        leaves: Leaves = []
        _read(self.schema, found, "", name, leaves)
        return leaves


def _pairs(pairs: list[tuple[Any, Any]]) -> dict[Any, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError("a key comes twice")
    return found


def _read(schema: Schema, found: Any, prefix: str, name: str, leaves: Leaves) -> None:
    if not isinstance(found, dict):
        place = f"{name}: {prefix[:-1]!r}" if prefix else name
        raise WireError(f"{place} expects a map of fields, but got {show(found)}.")
    for key in found:
        if key not in schema.entries:
            hint = nearest(key, schema.entries)
            raise WireError(f"{name} has no field {f'{prefix}{key}'!r}.{hint}")
    for key, entry in schema.entries.items():
        path = prefix + key
        if key not in found:
            raise WireError(f"{name}: {path!r} is missing from the payload.")
        if isinstance(entry, Schema):
            _read(entry, found[key], f"{path}/", name, leaves)
        else:
            leaves.append(_leaf(entry, found[key], f"{name}: {path!r}"))


def _leaf(field: Field, value: Any, where: str) -> Any:
    if field.shape:
        dtype = np.dtype(field.dtype).newbyteorder("<")
        size = field.size * dtype.itemsize
        if type(value) is not bytes or len(value) != size:
            raise WireError(
                f"{where} expects {size} bytes of array, but got {show(value)}."
            )
        if field.dtype == "bool" and value.strip(b"\0\1"):
            raise WireError(f"{where} expects bytes of 0 and 1.")
        value = np.frombuffer(value, dtype).reshape(field.shape)
    elif field.dtype == "list":
        return _list(field, value, where)
    elif field.numeric and type(value) is not int and type(value) is not float:
        raise WireError(f"{where} expects a number, but got {show(value)}.")
    try:
        return accept(field, value, where)
    except FieldValueError as why:
        raise WireError(str(why)) from why


def _list(field: Field, value: Any, where: str) -> tuple[Any, ...]:
    item = field.item
    if item is None or type(value) is not list or len(value) > field.max_len:
        raise WireError(
            f"{where} expects a list of at most {field.max_len}, but got {show(value)}."
        )
    made = []
    for i, one in enumerate(value):
        leaves: Leaves = []
        _read(item, one, "", f"{where}[{i}]", leaves)
        made.append(item.layout.new(leaves))
    return tuple(made)


# -- code ---------------------------------------------------------------------


def _fixed(field: Field) -> bool:
    return bool(field.shape) or field.dtype in ("float", "bool")


def _bytes(value: Any) -> bytes:
    packed: bytes = msgpack.packb(value)
    return packed


def _head(count: int) -> bytes:
    head: bytes = msgpack.Packer().pack_map_header(count)
    return head


def _parts(schema: Schema) -> list[bytes | Field]:
    """Return the constant bytes and the fields of a payload, in order."""
    parts: list[bytes | Field] = [_head(len(schema))]
    for key, entry in schema.entries.items():
        parts.append(_bytes(key))
        parts.extend(_parts(entry) if isinstance(entry, Schema) else [entry])
    return parts


def _fixed_code(schema: Schema) -> tuple[str, dict[str, Any]]:
    """Return the code of a codec with one layout of bytes."""
    names: dict[str, Any] = {"frombuffer": _array}
    formats, packed, unpacked, tests, made = [">"], [], [], [], []
    constant = b""
    for part in _parts(schema):
        if isinstance(part, bytes):
            constant += part
            continue
        i = len(made)
        low, high = part.limits if part.numeric else (0, 0)
        test = f"{low!r} <= v{i} <= {high!r}"
        if part.shape:
            dtype = np.dtype(part.dtype).newbyteorder("<")
            size = part.size * dtype.itemsize
            constant += _bytes(bytes(size))[:-size]
            code, put, get = f"{size}s", f"v{i}.tobytes()", f"a{i}"
            names[f"read{i}"] = _array(part, dtype)
            test = f"(a{i} := read{i}(v{i})) is not None"
        elif part.dtype == "bool":
            code, put, get = "B", f"0xC3 if v{i} else 0xC2", f"v{i} == 0xC3"
            test = f"0xC2 <= v{i} <= 0xC3"
        else:
            constant += b"\xcb"
            code, put, get = "d", f"v{i}", f"v{i}"
        names[f"K{i}"] = constant
        formats += [f"{len(constant)}s", code]
        packed += [f"K{i}", put]
        unpacked += [f"k{i}", f"v{i}"]
        tests += [f"k{i} == K{i}", test]
        made.append(get)
        constant = b""
    layout = struct.Struct("".join(formats))
    names.update(pack=layout.pack, unpack=layout.unpack)
    values = ", ".join(f"v{i}" for i in range(len(made)))
    source = (
        f"def encode(leaves):\n"
        f"    {values}, = leaves\n"
        f"    return pack({', '.join(packed)})\n\n"
        f"def decode(payload):\n"
        f"    if len(payload) == {layout.size} and type(payload) is bytes:\n"
        f"        {', '.join(unpacked)} = unpack(payload)\n"
        f"        if ({' and '.join(tests)}):\n"
        f"            return [{', '.join(made)}]\n"
        f"    return slow(payload)\n"
    )
    return source, names


def _array(field: Field, dtype: np.dtype[Any]) -> Callable[[bytes], Any]:
    """Return the reader of an array: the array, or None if it is not acceptable."""
    shape, bounds = field.shape, field.limits if field.dtype != "bool" else None
    open_ended = field.range is None and field.whole

    def read(data: bytes) -> Any:
        found = np.frombuffer(data, dtype).reshape(shape)
        if open_ended:
            return found
        if bounds is None:
            return None if data.strip(b"\0\1") else found
        low, high = bounds
        return found if ((found >= low) & (found <= high)).all() else None

    return read


def _open_code(schema: Schema) -> tuple[str, dict[str, Any]]:
    """Return the code of a codec whose payloads vary in length."""
    values = "".join(f"v{i}, " for i in range(len(schema.fields)))
    source = (
        f"def encode(leaves):\n"
        f"    {values or '[]'} = leaves\n"
        f"    return pack({_dict_code(schema, iter(range(len(schema.fields))))})\n\n"
        f"decode = slow\n"
    )
    return source, {"items": _items}


def _dict_code(schema: Schema, places: Any) -> str:
    rows = []
    for key, entry in schema.entries.items():
        if isinstance(entry, Schema):
            rows.append(f"{key!r}: {_dict_code(entry, places)}")
        else:
            value = f"v{next(places)}"
            if entry.shape:
                value += ".tobytes()"
            elif entry.dtype == "list":
                value = f"items({value})"
            rows.append(f"{key!r}: {value}")
    return f"{{{', '.join(rows)}}}"


def _items(values: tuple[Any, ...]) -> list[Mapping[str, Any]]:
    return [value.to_wire_map() for value in values]


# -- bounds -------------------------------------------------------------------


def _longest(schema: Schema) -> int:
    """Return the length of the longest payload, whoever encodes it."""
    size = _HEAD
    for key, entry in schema.entries.items():
        size += _HEAD + len(key.encode())
        size += _longest(entry) if isinstance(entry, Schema) else _longest_field(entry)
    return size


def _longest_field(field: Field) -> int:
    if field.shape:
        return _HEAD + field.size * np.dtype(field.dtype).itemsize
    if field.dtype == "list" and field.item is not None:
        return _HEAD + field.max_len * _longest(field.item)
    if field.dtype in ("str", "bytes"):
        return _HEAD + field.max_len
    if field.dtype == "choice":
        return _HEAD + max(len(one.encode()) for one in field.choices)
    return 9


def _most(schema: Schema) -> int:
    """Return the longest list in a schema."""
    return max(
        (
            max(field.max_len, _most(field.item))
            for field in schema.fields
            if field.item is not None
        ),
        default=0,
    )


def _widest(schema: Schema) -> int:
    """Return the largest number of keys in one map of a schema."""
    inner = [_widest(one) for one in schema.entries.values() if isinstance(one, Schema)]
    items = [_widest(field.item) for field in schema.fields if field.item is not None]
    return max([len(schema), *inner, *items])

"""Reading a payload with every check: the slow, exact path of the wire format.

A payload is one msgpack map, field to value, in schema order; groups are nested
maps, arrays are little-endian bytes. Maps in another order are read too, so are
whole numbers and short floats where a float belongs: other languages write them.
Anything else that does not fit raises WireError, and nothing is decoded before its
size is bounded by the schema.
"""

from typing import Any

import numpy as np

from rems_net.defdict.fields.accept import accept
from rems_net.defdict.fields.descriptions import show
from rems_net.defdict.fields.field import Field
from rems_net.defdict.trees.tree import Tree
from rems_net.errors import FieldValueError, WireError, nearest
from rems_net.packing import UNPACK_ERRORS, unpack, unpacker

Leaves = list[Any]
_HEAD = 5  # the longest header of a msgpack string, array or map


class Reader:
    """Reads payloads of one schema; knows how large they may be."""

    def __init__(self, tree: Tree) -> None:
        self.tree = tree
        self.max_size = longest(tree)
        self.max_list = _most(tree)
        self.max_map = max(_widest(tree), 1)
        self.plain = unpacker(self.max_list, self.max_map)

    def unpack(self, payload: bytes) -> Any:
        """Return what msgpack finds in a payload; raise WireError if it can't be."""
        name = self.tree.name
        if not isinstance(payload, bytes | bytearray | memoryview):
            raise WireError(f"{name}: a payload is bytes, not {show(payload)}. (R0123)")
        if len(payload) > self.max_size:
            raise WireError(
                f"{name}: {len(payload)} bytes came; its longest payload "
                f"has {self.max_size}. (R0123)"
            )
        try:
            return unpack(payload, longest_list=self.max_list, largest_map=self.max_map)
        except UNPACK_ERRORS as why:
            text = str(why).rstrip(".") or type(why).__name__
            json = " It looks like JSON." if bytes(payload[:1]) in (b"{", b"[") else ""
            raise WireError(
                f"{name}: the payload is not one msgpack map: {text}.{json} (R0123)"
            ) from why

    def read(self, payload: bytes) -> Leaves:
        """Return the checked leaves of a payload."""
        leaves: Leaves = []
        _read(self.tree, self.unpack(payload), "", self.tree.name, leaves)
        return leaves


def _read(tree: Tree, found: Any, prefix: str, name: str, leaves: Leaves) -> None:
    if not isinstance(found, dict):
        place = f"{name}: {prefix[:-1]!r}" if prefix else name
        raise WireError(
            f"{place} expects a map of fields, but got {show(found)}. (R0123)"
        )
    for key in found:
        if key not in tree.entries:
            hint = nearest(key, tree.entries)
            hint = hint or f" It has {', '.join(map(repr, tree.entries))}."
            raise WireError(f"{name} has no field {f'{prefix}{key}'!r}.{hint} (R0123)")
    for key, entry in tree.entries.items():
        path = prefix + key
        if key not in found:
            raise WireError(
                f"{name}: {path!r} is missing from the payload: use the same schema "
                "on both sides. (R0123)"
            )
        if isinstance(entry, Tree):
            _read(entry, found[key], f"{path}/", name, leaves)
        else:
            leaves.append(read_leaf(entry, found[key], f"{name}: {path!r}"))


def read_leaf(field: Field, value: Any, where: str) -> Any:
    """Return one checked leaf of what was unpacked."""
    if field.shape:
        size = field.size * field.element.itemsize
        if type(value) is not bytes or len(value) != size:
            raise WireError(
                f"{where} expects {size} bytes of array, but got {show(value)}. (R0123)"
            )
        if field.dtype == "bool" and value.strip(b"\0\1"):
            raise WireError(f"{where} expects bytes of 0 and 1. (R0123)")
        value = np.frombuffer(value, field.element).reshape(field.shape)
    elif field.dtype == "list":
        return _list(field, value, where)
    elif field.numeric and type(value) is not int and type(value) is not float:
        raise WireError(f"{where} expects a number, but got {show(value)}. (R0123)")
    try:
        return accept(field, value, where)
    except FieldValueError as why:
        raise WireError(str(why)) from why


def _list(field: Field, value: Any, where: str) -> tuple[Any, ...]:
    item = field.item
    if item is None or type(value) is not list or len(value) > field.max_len:
        raise WireError(
            f"{where} expects a list of at most {field.max_len}, but got "
            f"{show(value)}. (R0123)"
        )
    made = []
    for i, one in enumerate(value):
        leaves: Leaves = []
        _read(item, one, "", f"{where}[{i}]", leaves)
        made.append(item.around(leaves))
    return tuple(made)


def longest(tree: Tree) -> int:
    """Return the length of the longest payload of any encoder."""
    size = _HEAD
    for key, entry in tree.entries.items():
        size += _HEAD + len(key.encode())
        size += longest(entry) if isinstance(entry, Tree) else _longest_field(entry)
    return size


def _longest_field(field: Field) -> int:
    if field.shape:
        return _HEAD + field.size * field.element.itemsize
    if field.dtype == "list" and field.item is not None:
        return _HEAD + field.max_len * longest(field.item)
    if field.dtype in ("str", "bytes"):
        return _HEAD + field.max_len
    if field.dtype == "choice":
        return _HEAD + max(len(one.encode()) for one in field.choices)
    return 9


def _most(tree: Tree) -> int:
    """Return the longest list in a tree."""
    return max(
        (
            max(field.max_len, _most(field.item))
            for field in tree.fields
            if field.item is not None
        ),
        default=0,
    )


def _widest(tree: Tree) -> int:
    """Return the largest number of keys in one map of a tree."""
    inner = [_widest(one) for one in tree.entries.values() if isinstance(one, Tree)]
    items = [_widest(field.item) for field in tree.fields if field.item is not None]
    return max([len(tree), *inner, *items])

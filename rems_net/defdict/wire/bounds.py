"""How large a payload can be, whoever encodes it."""

from __future__ import annotations

from rems_net.defdict.fields.field import Field
from rems_net.defdict.trees.tree import Tree

_HEAD = 5  # the longest header of a msgpack string, array or map


def longest(tree: Tree) -> int:
    """Return the length of the longest payload, whoever encodes it."""
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


def longest_list(tree: Tree) -> int:
    """Return the longest list in a tree."""
    return max(
        (
            max(field.max_len, longest_list(field.item))
            for field in tree.fields
            if field.item is not None
        ),
        default=0,
    )


def largest_map(tree: Tree) -> int:
    """Return the largest number of keys in one map of a tree."""
    inner = [largest_map(one) for one in tree.entries.values() if isinstance(one, Tree)]
    items = [largest_map(field.item) for field in tree.fields if field.item is not None]
    return max([len(tree), *inner, *items])

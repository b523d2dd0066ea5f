"""When two values are the same, and when a number means the same in two schemas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rems_net.defdict.fields.field import Field
from rems_net.defdict.trees.tree import Tree
from rems_net.errors import UnitError


def same(a: Any, b: Any) -> bool:
    """Whether two stored values are equal: arrays and lists element by element."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return bool(np.array_equal(a, b))
    if type(a) is tuple and isinstance(b, Sequence):
        return len(a) == len(b) and all(map(same, a, b))
    return bool(a == b)


def comparable(a: Tree, b: Tree) -> bool:
    """Whether the values of two schemas can be equal at all."""
    return a.digest == b.digest or _meaning(a) == _meaning(b)


def _meaning(tree: Tree) -> set[tuple[object, ...]]:
    return {
        (path, field.unit, field.shape, field.means, field.table)
        for path, field in tree.rows()
    }


def check_units(target: Tree, prefix: str, source: Tree) -> None:
    """Raise UnitError if a number of the source would mean something else there."""
    if target.digest == source.digest:
        return
    for path, theirs in source.rows():
        mine = target.find(prefix + path)
        if isinstance(mine, Field) and mine.unit != theirs.unit:
            raise UnitError(
                f"{target.name}: {prefix + path!r} is in {mine.unit or 'plain numbers'}"
                f", but in {theirs.unit or 'plain numbers'} in {source.name}. Convert "
                f"it first: value.to(...)."
            )

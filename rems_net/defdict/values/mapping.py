"""Mapping: the keys and paths of a DefDict, its groups, and how fields are set.

Every class of values is for one schema, or for one group of it. `classes.py` adds a
fast path, which finds the limits and the place of a field in one look-up. All other
values come here, and are accepted or explained.
"""

from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn, Self, cast

import numpy as np

from rems_net.defdict.fields.accept import accept
from rems_net.defdict.fields.descriptions import show
from rems_net.defdict.fields.field import Field
from rems_net.defdict.trees.tree import Tree
from rems_net.defdict.values.globview import GlobView
from rems_net.errors import FieldValueError, FixedKeysError, UnitError

if TYPE_CHECKING:
    from rems_net.defdict.schema import Schema  # a value has its schema

Leaves = list[Any]
Fast = dict[str, tuple[float, float, int]]  # lowest, highest, place in the leaves


class FixedMapping(MutableMapping[str, Any]):
    """The leaves of one schema in a flat list; a group is a view with an offset."""

    __slots__ = ("_leaves",)

    _leaves: Leaves
    _root: ClassVar[Tree]  # the whole schema, of which a view shows a group
    _schema: "ClassVar[Schema]"
    _prefix: ClassVar[str]
    _first: ClassVar[int]
    _index: ClassVar[dict[str, int]]
    _fast: ClassVar[Fast]
    _lists: ClassVar[bool]  # whether a leaf is a list, whose items can change
    # Functions of the class; Any, for mypy takes a Callable here for a method.
    _blank: ClassVar[Any]  # () -> leaves: the defaults
    _around: ClassVar[Any]  # (leaves) -> value of this class, unchecked
    _group: ClassVar[Any]  # (path) -> class of the views on that group
    _is_locked: ClassVar[bool] = False  # whether it is read-only
    _locks: ClassVar[Any]  # error's maker -> class of read-only values

    def __init__(self, *args: object, **kwargs: object) -> None:
        raise FieldValueError(
            "a DefDict is made by its schema: value = schema({'x': 1.0}). (R0108)"
        )

    def __getitem__(self, key: str) -> Any:
        return self._look(key)

    def __setitem__(self, key: str, value: Any) -> None:
        self._set(key, value)

    def __iter__(self) -> Iterator[str]:
        return iter(self._schema.entries)

    def __len__(self) -> int:
        return len(self._schema.entries)

    def __contains__(self, key: object) -> bool:
        return key in self._schema

    def __delitem__(self, key: str) -> NoReturn:
        raise FixedKeysError(
            f"the keys of {self._place()} are fixed by its schema and cannot be "
            f"removed. dict(value) is a dict of its own. (R0106)"
        )

    def update(self, other: Any = (), /, **fields: Any) -> None:
        """Set the given fields: all of them or (if one is refused) none."""
        if isinstance(other, FixedMapping):
            _check_units(self._root, self._prefix, other._schema)
            other = other.flat()
        leaves = self._leaves
        keep = leaves.copy()
        fast: Fast = {} if self._is_locked else self._fast
        try:
            pairs = other.items() if hasattr(other, "items") else other
            for key, value in pairs:
                if type(value) is float and type(key) is str and key in fast:
                    low, high, place = fast[key]  # as in `__setitem__`, without a call
                    if low <= value <= high:
                        leaves[place] = value
                        continue
                self[key] = value
            for key, value in fields.items():
                self[key] = value
        except Exception:
            self._leaves[:] = keep
            raise

    def __reversed__(self) -> Iterator[str]:
        return reversed(list(self))

    def __or__(self, other: Any) -> Self:
        if not isinstance(other, Mapping):
            return NotImplemented
        made = self.copy()
        made.update(other)
        return made

    def __ror__(self, other: Any) -> dict[str, Any]:
        if not isinstance(other, Mapping):
            return NotImplemented
        return {**other, **self}

    def __ior__(self, other: Any) -> Self:
        self.update(other)
        return self

    def __eq__(self, other: object) -> bool:
        if isinstance(other, FixedMapping):
            if not _comparable(self._schema, other._schema):
                return False
            a, b = self.flat(), other.flat()
            return all(_same(a[path], b[path]) for path in a)
        if isinstance(other, Mapping):
            if len(other) != len(self) or any(key not in other for key in self):
                return False
            return all(_same(self[key], other[key]) for key in self)
        return NotImplemented

    def copy(self) -> Self:
        """Return a value of the same schema that shares nothing with this one."""
        leaves = self.leaves()
        made = self._schema.around(copied(leaves) if self._lists else leaves)
        return cast("Self", made)  # of a group: an independent value

    def __copy__(self) -> Self:
        return self.copy()

    def __deepcopy__(self, memo: object) -> Self:
        return self.copy()

    @property
    def schema(self) -> "Schema":
        """The schema of this value."""
        return self._schema

    def leaves(self) -> Leaves:
        """Return the values of all fields in schema order, as a new list."""
        first = self._first
        return self._leaves[first : first + len(self._schema.paths)]

    def flat(self) -> dict[str, Any]:
        """Return a plain dict of path to value."""
        return dict(zip(self._schema.paths, self.leaves(), strict=True))

    def _assign(self, values: Any) -> None:
        """Set from a mapping (some fields), or a sequence (every leaf in order)."""
        if isinstance(values, Mapping):
            self.update(values)
            return
        if isinstance(values, str | bytes) or not isinstance(
            values, Sequence | np.ndarray
        ):
            raise FieldValueError(
                f"{self._place()} expects a dict of fields, or one value for each of "
                f"its {len(self._schema.paths)} fields; got {show(values)}. (R0107)"
            )
        paths = self._schema.paths
        if len(values) != len(paths):
            raise FieldValueError(
                f"{self._place()} has {len(paths)} fields ({_some(paths)}), but "
                f"{len(values)} values came. Give one for each, or name some in a "
                "dict. (R0107)"
            )
        self.update(zip(paths, values, strict=True))

    def _set(self, key: str, value: Any) -> None:
        place = self._index.get(key) if isinstance(key, str) else None
        if type(value) is int and key in self._fast:
            low, high, place = self._fast[key]
            if low <= value <= high:
                self._leaves[place] = float(value)
                return
        if place is not None:
            field = self._root.fields[place]
            self._leaves[place] = accept(field, value, self._where(key))
            return
        self._look(key)._assign(value)

    def _look(self, key: Any) -> Any:
        if isinstance(key, str):
            if "*" in key:
                return GlobView(self, self._schema, key)
            if isinstance(self._schema.find(key), Tree):
                return self._group(self._prefix + key)._around(self._leaves)
        raise self._unknown(key)

    def _place(self) -> str:
        name = self._root.name
        return f"{name}: {self._prefix[:-1]!r}" if self._prefix else name

    def _where(self, key: str) -> str:
        return f"{self._root.name}: {self._prefix + key!r}"

    def _unknown(self, key: object) -> Exception:
        if not self._prefix:
            return self._schema.unknown(key)
        return self._root.unknown(f"{self._prefix}{key}")


def copied(leaves: Leaves) -> Leaves:
    """Return leaves that share nothing mutable: the items of lists are copied."""
    return [
        tuple(item.copy() for item in leaf) if type(leaf) is tuple else leaf
        for leaf in leaves
    ]


def _some(paths: Sequence[str]) -> str:
    more = ", ..." if len(paths) > 8 else ""
    return ", ".join(map(repr, paths[:8])) + more


def _same(a: Any, b: Any) -> bool:
    """Return whether two stored values are equal; arrays and lists by element."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return bool(np.array_equal(a, b))
    if type(a) is tuple and isinstance(b, Sequence):
        return len(a) == len(b) and all(map(_same, a, b))
    return bool(a == b)


def _comparable(a: Tree, b: Tree) -> bool:
    """Return whether the values of two schemas can be equal at all."""
    return a.digest == b.digest or _meaning(a) == _meaning(b)


def _meaning(tree: Tree) -> set[tuple[object, ...]]:
    return {
        (path, field.unit, field.shape, field.means, field.table)
        for path, field in tree.rows()
    }


def _check_units(target: Tree, prefix: str, source: Tree) -> None:
    """Raise UnitError if a number of the source would mean something else there."""
    if target.digest == source.digest:
        return
    for path, theirs in source.rows():
        mine = target.find(prefix + path)
        if isinstance(mine, Field) and mine.unit != theirs.unit:
            raise UnitError(
                f"{target.name}: {prefix + path!r} is in {mine.unit or 'plain numbers'}"
                f", but in {theirs.unit or 'plain numbers'} in {source.name}. Convert "
                f"it first: value.to(...). (R0102)"
            )

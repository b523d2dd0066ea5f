"""A DefDict: live values of one schema, behaving like a dict whose keys are fixed.

    value = command()
    value["wheel/left"] = 1.0          # a number in the field's unit
    value.wheel.left = "250 deg/s"     # or any other unit, as text or from unyt
    value["wheel"]                     # a live view on the group

Every class made here is for one schema (or one group of one): its fast path finds
the limits and the place of a field in one look-up, everything else takes `assign`.
"""

from __future__ import annotations

from collections.abc import (
    Iterable,
    Iterator,
    Mapping,
    MutableMapping,
    Sequence,
)
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from rems_net.defdict.accept import accept, show
from rems_net.defdict.compare import check_units, comparable, same
from rems_net.defdict.schema import Schema
from rems_net.errors import (
    FieldValueError,
    FixedKeysError,
    UnknownAttributeError,
)

if TYPE_CHECKING:
    from rems_net.defdict.layout import Layout
    from rems_net.defdict.rule import Rule

__all__ = ["DefDict"]

Leaves = list[Any]
Fast = dict[str, tuple[float, float, int]]  # lowest, highest, place in the leaves


class DefDict(MutableMapping[str, Any]):
    """Live values of one schema. Made by calling the schema, never directly."""

    __slots__ = ("_leaves",)

    _leaves: Leaves
    _layout: Layout
    _schema: Schema
    _prefix: str
    _first: int
    _index: dict[str, int]
    _fast: Fast

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, *args: object, **kwargs: object) -> None:
        raise FieldValueError(
            "a DefDict is made by its schema: value = schema({'x': 1.0})."
        )

    # -- one field ------------------------------------------------------------
    # `value_class` puts faster versions of these three in front of them.

    def __getitem__(self, key: str) -> Any:
        return self._look(key)

    def __setitem__(self, key: str, value: Any) -> None:
        self._set(key, value)

    def __setattr__(self, key: str, value: Any) -> None:
        if key not in self._schema.entries:
            raise UnknownAttributeError(str(self._unknown(key)))
        if taken(key):
            raise self._hidden(key)
        self._set(key, value)

    def __getattr__(self, key: str) -> Any:
        if key.startswith("__"):
            raise AttributeError(key)
        raise UnknownAttributeError(str(self._unknown(key)))

    # -- the rest of the mapping ----------------------------------------------

    def __iter__(self) -> Iterator[str]:
        return iter(self._schema.entries)

    def __len__(self) -> int:
        return len(self._schema.entries)

    def __contains__(self, key: object) -> bool:
        return key in self._schema

    def __delitem__(self, key: str) -> NoReturn:
        raise self._fixed()

    def pop(self, key: str, default: Any = None) -> NoReturn:
        """Refuse: the keys are fixed by the schema."""
        raise self._fixed()

    def popitem(self) -> NoReturn:
        """Refuse: the keys are fixed by the schema."""
        raise self._fixed()

    def clear(self) -> NoReturn:
        """Refuse: the keys are fixed by the schema."""
        raise self._fixed()

    def setdefault(self, key: str, default: Any = None) -> Any:
        """Return the value at the key, which is always there."""
        return self[key]

    def update(self, other: Any = (), /, **fields: Any) -> None:
        """Set several fields, all of them or (if one is refused) none."""
        if isinstance(other, DefDict):
            check_units(self._layout.schema, self._prefix, other._schema)
            other = other.flat()
        keep = self._leaves.copy()
        try:
            pairs = other.items() if hasattr(other, "items") else other
            for key, value in pairs:
                self[key] = value
            for key, value in fields.items():
                self[key] = value
        except Exception:
            self._leaves[:] = keep
            raise

    def __reversed__(self) -> Iterator[str]:
        return reversed(list(self))

    def __or__(self, other: Any) -> DefDict:
        if not isinstance(other, Mapping):
            return NotImplemented
        made = self.copy()
        made.update(other)
        return made

    def __ror__(self, other: Any) -> dict[str, Any]:
        if not isinstance(other, Mapping):
            return NotImplemented
        return {**other, **self}

    def __ior__(self, other: Any) -> DefDict:
        self.update(other)
        return self

    def __eq__(self, other: object) -> bool:
        if isinstance(other, DefDict):
            if not comparable(self._schema, other._schema):
                return False
            a, b = self.flat(), other.flat()
            return all(same(a[path], b[path]) for path in a)
        if isinstance(other, Mapping):
            if len(other) != len(self) or any(key not in other for key in self):
                return False
            return all(same(self[key], other[key]) for key in self)
        return NotImplemented

    def copy(self) -> DefDict:
        """Return a value of the same schema that shares nothing with this one."""
        layout = self._schema.layout
        return layout.new(layout.copy(self.leaves()))

    def __copy__(self) -> DefDict:
        return self.copy()

    def __deepcopy__(self, memo: object) -> DefDict:
        return self.copy()

    def __reduce_ex__(self, protocol: object) -> NoReturn:
        raise TypeError(
            f"a DefDict is not pickled: send payload = value.encode(), and read it "
            f"with the schema of {self._schema.name}: value = schema.decode(payload)."
        )

    # -- what is inside -------------------------------------------------------

    @property
    def schema(self) -> Schema:
        """The schema of this value."""
        return self._schema

    def leaves(self) -> Leaves:
        """Return the leaf values in schema order, as a new list."""
        first = self._first
        return self._leaves[first : first + len(self._schema.paths)]

    def flat(self) -> dict[str, Any]:
        """Return a plain dict of path to value."""
        return dict(zip(self._schema.paths, self.leaves(), strict=True))

    def to_dict(self) -> dict[str, Any]:
        """Return a plain nested dict of copies."""
        return {
            key: value.to_dict()
            if isinstance(value, DefDict)
            else [item.to_dict() for item in value]
            if type(value) is tuple
            else value
            for key, value in self.items()
        }

    def to_wire_map(self) -> dict[str, Any]:
        """Return the nested dict that is packed: arrays as bytes."""
        return {
            key: value.to_wire_map()
            if isinstance(value, DefDict)
            else [item.to_wire_map() for item in value]
            if type(value) is tuple
            else value.tobytes()
            if isinstance(value, np.ndarray)
            else value
            for key, value in self.items()
        }

    def encode(self) -> bytes:
        """Return the payload: one msgpack map in schema order."""
        if self._prefix or self._first:
            return self._schema.layout.encode(self.leaves())
        return self._layout.encode(self._leaves)

    def to(self, target: Schema, rules: Iterable[Rule] = ()) -> DefDict:
        """Return this value converted into another schema."""
        return self._schema.converter(target, tuple(rules))(self)

    def clip(
        self, values: Mapping[str, Any] | None = None, /, **fields: Any
    ) -> dict[str, Any]:
        """Set fields limited to their ranges; return path to what was kept."""
        from rems_net.defdict.numbers import clip

        return clip(self, {**(values or {}), **fields})

    def quantity(self, path: str) -> Any:
        """Return a field as a quantity of unyt."""
        from rems_net.defdict.numbers import quantity

        return quantity(self, path)

    def with_units(self) -> dict[str, Any]:
        """Return path to quantity of unyt, for the fields that have a unit."""
        from rems_net.defdict.numbers import with_units

        return with_units(self)

    def to_array(self, *, column: bool = False) -> np.ndarray[Any, Any]:
        """Return the numbers of all fields as a vector, or as a column."""
        from rems_net.defdict.numbers import to_array

        return to_array(self, column)

    def from_array(self, numbers: Any) -> None:
        """Set all fields from a vector or a column of numbers."""
        from rems_net.defdict.numbers import from_array

        from_array(self, numbers)

    def describe(self) -> dict[str, dict[str, Any]]:
        """Return {path: {"value": ..., "unit": ...}} of what JSON can hold."""
        from rems_net.defdict.numbers import describe

        return describe(self)

    def __repr__(self) -> str:
        from rems_net.defdict.numbers import one_line

        return one_line(self)

    def __str__(self) -> str:
        from rems_net.defdict.numbers import lines

        return lines(self)

    # -- the slow path --------------------------------------------------------

    def assign(self, values: Any) -> None:
        """Set from a mapping (some fields), or a sequence (every leaf in order)."""
        if isinstance(values, Mapping):
            self.update(values)
            return
        if isinstance(values, str | bytes) or not isinstance(
            values, Sequence | np.ndarray
        ):
            raise FieldValueError(
                f"{self._place()} expects a dict of fields, or one value for each of "
                f"its {len(self._schema.paths)} fields; got {show(values)}."
            )
        paths = self._schema.paths
        if len(values) != len(paths):
            raise FieldValueError(
                f"{self._place()} has {len(paths)} fields ({_some(paths)}), but "
                f"{len(values)} values came."
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
            field = self._layout.fields[place]
            self._leaves[place] = accept(field, value, self._where(key))
            return
        target = self._look(key)
        if not isinstance(target, DefDict):
            target.assign(value)
            return
        if isinstance(value, Mapping):
            for path in target._schema.paths:
                if path not in value and path.split("/")[0] not in value:
                    raise FieldValueError(
                        f"{self._where(key)} expects all of "
                        f"{_some(target.schema.paths)}; {path!r} is missing. "
                        f"To set some of them, use update()."
                    )
        target.assign(value)

    def _look(self, key: Any) -> Any:
        if isinstance(key, str):
            if "*" in key:
                from rems_net.defdict.glob import GlobView

                return GlobView(self, key)
            found = self._schema._find(key)
            if isinstance(found, Schema):
                return self._layout.view(self._prefix + key, self._leaves)
        raise self._unknown(key)

    # -- words ----------------------------------------------------------------

    def _place(self) -> str:
        name = self._layout.schema.name
        return f"{name}: {self._prefix[:-1]!r}" if self._prefix else name

    def _where(self, key: str) -> str:
        return f"{self._layout.schema.name}: {self._prefix + key!r}"

    def _unknown(self, key: object) -> Exception:
        if not self._prefix:
            return self._schema.unknown(key)
        return self._layout.schema.unknown(f"{self._prefix}{key}")

    def _fixed(self) -> FixedKeysError:
        return FixedKeysError(
            f"the keys of {self._place()} are fixed by its schema and cannot be "
            f"removed. dict(value) is a dict of its own."
        )

    def _hidden(self, key: str) -> UnknownAttributeError:
        return UnknownAttributeError(
            f"{self._where(key)} has the name of a method of every DefDict. "
            f"Write value[{key!r}] = ..."
        )


def taken(name: str) -> bool:
    """Whether DefDict itself needs the attribute of that name."""
    return hasattr(DefDict, name) or name in DefDict.__annotations__


def _some(paths: Sequence[str]) -> str:
    more = ", ..." if len(paths) > 8 else ""
    return ", ".join(map(repr, paths[:8])) + more

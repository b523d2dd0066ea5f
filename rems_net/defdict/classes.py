"""The classes behind DefDict: one for each schema, and for each group of it.

Python looks up special methods on the class, so each class gets its own, closed
over the places and limits of its fields: setting a float is one look-up and one
comparison. What does not pass goes to the methods of DefDict, which explain.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rems_net.defdict.schema import Schema
from rems_net.defdict.value import DefDict, Fast, Leaves, taken

if TYPE_CHECKING:
    from rems_net.defdict.layout import Layout

_new = object.__new__
_put: Callable[[DefDict, Leaves], None] = vars(DefDict)["_leaves"].__set__


def view(kind: type[DefDict], leaves: Leaves) -> DefDict:
    """Return a value over these leaves, which it shares."""
    made = _new(kind)
    _put(made, leaves)
    return made


def value_class(
    layout: Layout, schema: Schema, prefix: str, first: int
) -> type[DefDict]:
    """Make the class of the values of a schema, or of the views on a group."""
    index = {path: first + i for i, path in enumerate(schema.paths)}
    fast = {
        path: (*field.limits, index[path])
        for path, field in zip(schema.paths, schema.fields, strict=True)
        if field.dtype == "float" and not field.shape
    }
    body: dict[str, Any] = {
        "__slots__": (),
        "_layout": layout,
        "_schema": schema,
        "_prefix": prefix,
        "_first": first,
        "_index": index,
        "_fast": fast,
        "__getitem__": _reader(index),
        "__setitem__": _setter(fast, DefDict.__setitem__),
        "__setattr__": _setter(
            {key: fast[key] for key in fast if not taken(key)},
            DefDict.__setattr__,
        ),
    }
    for key in schema.entries:
        if key.isidentifier() and not taken(key):
            body[key] = property(_getter(prefix, key, index.get(key)))
    return type(f"DefDict[{schema.name}]", (DefDict,), body)


def _reader(index: dict[str, int]) -> Callable[[DefDict, Any], Any]:
    def read(self: DefDict, key: Any) -> Any:
        try:
            return self._leaves[index[key]]
        except (KeyError, TypeError):
            return self._look(key)

    return read


def _setter(
    fast: Fast, slow: Callable[[DefDict, str, Any], None]
) -> Callable[[DefDict, str, Any], None]:
    def put(self: DefDict, key: str, value: Any) -> None:
        if type(value) is float:
            try:
                low, high, place = fast[key]
            except (KeyError, TypeError):
                return slow(self, key, value)
            if low <= value <= high:
                self._leaves[place] = value
                return None
        return slow(self, key, value)

    return put


def _getter(prefix: str, key: str, place: int | None) -> Callable[[DefDict], Any]:
    if place is None:
        group = f"{prefix}{key}"
        return lambda self: self._layout.view(group, self._leaves)
    return lambda self: self._leaves[place]

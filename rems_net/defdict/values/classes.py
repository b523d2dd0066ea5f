"""Classes behind DefDict: one for each schema, and for each group of it.

Python looks up special methods on the class. So each class gets its own, closed over
the places and limits of its
fields: setting a float is one look-up and one comparison. Other values go to the
    methods of DefDict, which explain errors. Equal schemas share their class, and the
    code that is compiled for it.
"""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from functools import cache, lru_cache, partial
from itertools import repeat
from operator import attrgetter
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict.fields.accept import accept
from rems_net.defdict.trees.tree import Tree
from rems_net.defdict.values.mapping import Fast, FixedMapping, Leaves, copied
from rems_net.defdict.values.value import DefDict, taken
from rems_net.defdict.wire.codec import Code, decoder, encoder
from rems_net.defdict.wire.reader import Reader

new = object.__new__
become: Callable[[DefDict, type[DefDict]], None] = vars(object)["__class__"].__set__
#: Makes the error for setting a read-only field, from its path.
Refusal = Callable[[str], Exception]
put: Callable[[FixedMapping, Leaves], None] = vars(FixedMapping)["_leaves"].__set__


@lru_cache(maxsize=2048)
def value_class(tree: Tree) -> type[DefDict]:
    """Return the class of the values of a schema."""
    made: Any = _class(tree, tree, "", 0, cache(lambda path: _group(made, path)))
    made.encode = encoder(tree)  # a whole value reads its leaves itself
    kind: type[DefDict] = made
    return kind


#: The reader of a schema's payloads, with every check.
reader = lru_cache(maxsize=2048)(Reader)


@lru_cache(maxsize=2048)
def decode(tree: Tree) -> Callable[[object, bytes], DefDict]:
    """Return the method of a schema that makes a value from a payload."""
    return decode_into(tree, tree, Code([]), [f"v{i}" for i in range(len(tree.fields))])


def decode_into(
    source: Tree, target: Tree, between: Code, leaves: list[str]
) -> Callable[[object, bytes], DefDict]:
    """Compile: read a payload, run the code of `between`, and make a value."""
    code = decoder(source, reader(source))
    made = ["made = new(kind)", f"put(made, [{', '.join(leaves)}])", "return made"]
    code.lines += between.lines + made
    code.names |= between.names | {"new": new, "put": put, "kind": value_class(target)}
    title = f"{source.name} to {target.name}"
    return code.compile("def decode(self, payload):", title)


def own_leaves(tree: Tree, value: Any) -> Leaves | None:
    """Return the leaves of a value with the same meaning, in the order of this schema.

    None if it is a DefDict of a schema with another meaning.
    """
    if not isinstance(value, DefDict) or value.schema.digest != tree.digest:
        return None
    if value.schema.paths == tree.paths:
        return value.leaves()
    found = value.flat()
    return [accept(field, found[path], tree.name) for path, field in tree.rows()]


def _class(
    root: Tree, tree: Tree, prefix: str, first: int, views: Callable[[str], Any]
) -> Any:
    index = {path: first + i for i, path in enumerate(tree.paths)}
    fast = {
        path: (*field.limits, index[path])
        for path, field in tree.rows()
        if field.dtype == "float" and not field.shape
    }
    defaults = [field.default for field in tree.fields]
    lists = any(field.dtype == "list" for field in tree.fields)
    blank = partial(copied, defaults) if lists else defaults.copy
    body: dict[str, Any] = {
        "__slots__": (),
        "_root": root,
        "_schema": tree,
        "_prefix": prefix,
        "_first": first,
        "_index": index,
        "_fast": fast,
        "_lists": lists,
        "_blank": staticmethod(blank),
        "__getitem__": _reader(index),
        "__setitem__": _setter(fast, DefDict.__setitem__),
        "__setattr__": _setter(
            {key: fast[key] for key in fast if not taken(key)},
            DefDict.__setattr__,
        ),
        "_group": staticmethod(views),
        "_locks": {},
    }
    for key in tree.entries:
        if key.isidentifier() and not taken(key):
            body[key] = property(_getter(prefix, key, index.get(key)))
    return _made(DefDict, body, f"DefDict[{tree.name}]")


def _made(base: type[DefDict], body: dict[str, Any], name: str = "") -> Any:
    kind: Any = type(name or base.__name__, (base,), body)

    def around(leaves: Leaves) -> DefDict:
        made: DefDict = new(kind)
        put(made, leaves)
        return made

    kind._around = staticmethod(around)
    return kind


def _group(whole: Any, path: str) -> Any:
    """Return the class of the live views on a nested group."""
    tree = whole._root[path]
    assert isinstance(tree, Tree)
    first = whole._index[f"{path}/{tree.paths[0]}"]
    return _class(whole._root, tree, f"{path}/", first, whole._group)


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
        return lambda self: self._group(group)._around(self._leaves)
    return lambda self: self._leaves[place]


def lock(value: DefDict, refuse: Refusal) -> DefDict:
    """Make a value read-only from now on, for all that have it. Return it.

    Setting anything in it raises what `refuse` returns. Its copies can be set.
    """
    become(value, value._locks.get(refuse) or _locked(type(value), refuse))
    if value._lists:
        for leaf in value._leaves:
            if type(leaf) is tuple:
                for item in leaf:
                    lock(item, refuse)
    return value


def shown(value: DefDict, refuse: Refusal) -> DefDict:
    """Return a read-only live view of a whole value: itself if it is read-only."""
    if value._is_locked:
        return value
    kind: Any = value._locks.get(refuse) or _locked(type(value), refuse)
    view: DefDict = kind._around(value._leaves)
    return view


def _locked(kind: Any, refuse: Refusal) -> type[DefDict]:
    """Return the read-only class of values like those of `kind`."""

    def refused(self: DefDict, key: str, value: object) -> NoReturn:
        raise refuse(f"{self._prefix}{key}")

    body = {
        "__slots__": (),
        "__setitem__": refused,
        "__setattr__": refused,
        "_is_locked": True,
        "_group": staticmethod(cache(lambda path: _locked(kind._group(path), refuse))),
    }
    made: type[DefDict] = kind._locks.setdefault(refuse, _made(kind, body))
    return made


def anew(value: DefDict) -> DefDict:
    """Return a value of the same class, locked or not, with the defaults."""
    made: DefDict = value._around(value._blank())
    return made


def changed(value: DefDict, fields: Mapping[str, Any]) -> DefDict:
    """Return a value of the same class, locked or not, with some fields changed.

    fields: values by the paths of the fields
    """
    made = value.copy()
    made.update(fields)
    become(made, type(value))
    return made


def refill(value: DefDict, other: DefDict) -> None:
    """Give a whole value the leaves of another of its schema. Nothing is checked."""
    value._leaves[:] = other._leaves


#
# For a thousand robots in one process, a method call for each value would cost more
# than the work on it.

_leaves = attrgetter("_leaves")
_all = slice(None)


def gather(values: Iterable[DefDict]) -> NDArray[np.float64]:
    """Return the numbers of whole values of one schema: shape (values, fields)."""
    return np.array(list(map(_leaves, values)), dtype=np.float64)


def scatter(rows: Iterable[Leaves], values: Iterable[DefDict]) -> None:
    """Give each value the leaves of its row. Nothing is checked."""
    kept: map[Any] = map(list.__setitem__, map(_leaves, values), repeat(_all), rows)
    deque(kept, maxlen=0)

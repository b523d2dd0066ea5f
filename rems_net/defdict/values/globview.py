"""Globs over the fields of a DefDict: the same that select keys on the fabric.

`value["*/velocity"]`, `value["**/position"]`; `paths.py` explains the marks.
"""

from collections.abc import Iterable, Iterator, Mapping, MutableMapping, Sequence
from typing import Any, NoReturn

import numpy as np

from rems_net.defdict.fields.field import Field
from rems_net.defdict.trees.paths import matching
from rems_net.defdict.trees.tree import Tree
from rems_net.defdict.values.arithmetic import Arithmetic
from rems_net.errors import FieldValueError, FixedKeysError


class GlobView(MutableMapping[str, Any], Arithmetic):
    """A live view on the fields that a glob selects: path to value."""

    __slots__ = ("_glob", "_paths", "_tree", "_value")

    def __init__(self, value: MutableMapping[str, Any], tree: Tree, glob: str) -> None:
        self._value, self._tree, self._glob = value, tree, glob
        self._paths = matching(glob, tree.paths)
        if not self._paths:
            raise tree.unknown(glob)

    def __getitem__(self, path: str) -> Any:
        self._check(path)
        return self._value[path]

    def __setitem__(self, path: str, value: Any) -> None:
        self._check(path)
        self._value[path] = value

    def _check(self, path: object) -> None:
        if path not in self._paths:
            raise self._tree.unknown(path)

    def __delitem__(self, path: str) -> NoReturn:
        raise FixedKeysError(
            f"the fields of {self._tree.name} are fixed by its schema and cannot be "
            "removed. (R0106)"
        )

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)

    def _assign(self, given: Any) -> None:
        """Set every field: one value for all, a dict, or a value for each."""
        if isinstance(given, Mapping):
            for path in given:
                self._check(path)
            self._value.update(given)
            return
        many = isinstance(given, Sequence) and not isinstance(given, str | bytes)
        if many or (isinstance(given, np.ndarray) and given.ndim):
            if len(given) != len(self._paths):
                raise FieldValueError(
                    f"{self._tree.name}: {self._glob!r} selects "
                    f"{len(self._paths)} fields, but {len(given)} values came. Give "
                    "one for each. (R0107)"
                )
            self._value.update(dict(zip(self._paths, given, strict=True)))
            return
        self._value.update(dict.fromkeys(self._paths, given))

    def _named(self) -> tuple[str, Iterable[tuple[str, Field, Any]]]:
        fields = dict(self._tree.rows())
        rows = ((path, fields[path], self._value[path]) for path in self._paths)
        return f"{self._tree.name}: {self._glob!r}", rows

    def __repr__(self) -> str:
        inside = ", ".join(f"{path}={value!r}" for path, value in self.items())
        return f"{self._tree.name}[{self._glob}]({inside})"

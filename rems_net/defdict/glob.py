"""Globs over the fields of a DefDict: the same that select keys on the fabric.

`*` stands for one chunk of a path, `**` for any number of chunks, and `$*` for any
characters inside a chunk: `value["*/velocity"]`, `value["**/position"]`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from rems_net.errors import FieldValueError, FixedKeysError

if TYPE_CHECKING:
    from rems_net.defdict.value import DefDict


@lru_cache(maxsize=1024)
def _pattern(glob: str) -> re.Pattern[str]:
    parts: list[str] = []
    for chunk in glob.split("/"):
        if chunk == "**":
            parts.append("(?:[^/]+/)*")
        elif chunk == "*":
            parts.append("[^/@][^/]*/")
        else:
            words = chunk.split("$*")
            parts.append("[^/]*".join(map(re.escape, words)) + "/")
    return re.compile("".join(parts))


def matching(glob: str, paths: Sequence[str]) -> tuple[str, ...]:
    """Return the paths that a glob selects, in order."""
    pattern = _pattern(glob)
    return tuple(path for path in paths if pattern.fullmatch(f"{path}/"))


class GlobView(MutableMapping[str, Any]):
    """A live view on the fields that a glob selects: path to value."""

    __slots__ = ("_glob", "_paths", "_value")

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, value: DefDict, glob: str) -> None:
        self._value, self._glob = value, glob
        self._paths = matching(glob, value.schema.paths)
        if not self._paths:
            raise value.schema.unknown(glob)

    def __getitem__(self, path: str) -> Any:
        self._check(path)
        return self._value[path]

    def __setitem__(self, path: str, value: Any) -> None:
        self._check(path)
        self._value[path] = value

    def _check(self, path: object) -> None:
        if path not in self._paths:
            raise self._value.schema.unknown(path)

    def __delitem__(self, path: str) -> NoReturn:
        raise FixedKeysError(f"the fields of {self._value.schema.name} are fixed.")

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)

    def assign(self, given: Any) -> None:
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
                    f"{self._value.schema.name}: {self._glob!r} selects "
                    f"{len(self._paths)} fields, but {len(given)} values came."
                )
            self._value.update(dict(zip(self._paths, given, strict=True)))
            return
        self._value.update(dict.fromkeys(self._paths, given))

    def to_array(self) -> np.ndarray[Any, Any]:
        """Return the selected numbers as a vector."""
        parts = [np.ravel(np.asarray(x, dtype=np.float64)) for x in self.values()]
        return np.concatenate(parts)

    def __repr__(self) -> str:
        inside = ", ".join(f"{path}={value!r}" for path, value in self.items())
        return f"{self._value.schema.name}[{self._glob}]({inside})"

"""Paths: names, paths made of them, and the globs that select paths.

Names are those that a key of the fabric can have. `*` stands for one chunk of a path,
`**` for any number of chunks, and `$*` for any characters inside a chunk.
"""

import re
from collections.abc import Sequence
from functools import lru_cache

_NAME = re.compile(r"[^@\s/*$#?][^\s/*$#?]*")
MAX_DEPTH, MAX_NAME = 16, 64


@lru_cache(maxsize=4096)
def chunks_of(path: str) -> tuple[str, ...]:
    """Return the names in a path; () if one of them is not a valid name."""
    chunks = tuple(path.split("/"))
    good = path.isprintable() and all(
        _NAME.fullmatch(one) and len(one.encode()) <= MAX_NAME for one in chunks
    )
    return chunks if good else ()


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

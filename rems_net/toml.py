"""TOML, as files and command lines bring it: every mistake in it is one kind of error.

Python's own reader calls itself for each bracket, so a line of 100,000 of them ends in
a RecursionError. Dots in a key make tables as deep, in which other code would end so.
"""

from __future__ import annotations

import tomllib
from typing import Any

TOMLDecodeError = tomllib.TOMLDecodeError

#: Tables and lists one inside the other; a settings file needs four.
DEEPEST = 100


def loads(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text. Raises TOMLDecodeError for what is no TOML."""
    try:
        tables = tomllib.loads(text)
    except RecursionError:
        raise _too_deep(text) from None
    level: list[Any] = [tables]
    for _ in range(DEEPEST):
        level = [part for whole in level for part in _parts(whole)]
        if not level:
            return tables
    raise _too_deep(text)


def _parts(whole: Any) -> list[Any]:
    if isinstance(whole, dict):
        return list(whole.values())
    return whole if isinstance(whole, list) else []


def _too_deep(text: str) -> TOMLDecodeError:
    return TOMLDecodeError(
        f"it has more than {DEEPEST} tables or lists one inside the other "
        f"(at {_deepest(text)})"
    )


def _deepest(text: str) -> str:
    """Return where so many brackets are open, as Python's own errors say it."""
    depth = 0
    for number, line in enumerate(text.split("\n"), 1):
        for column, letter in enumerate(line, 1):
            depth += (letter in "[{") - (letter in "]}")
            if depth > DEEPEST:
                return f"line {number}, column {column}"
    return "end of document"

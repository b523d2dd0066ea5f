"""TOML, as files and command lines bring it: every mistake in it is one kind of error.

Python's own reader calls itself for each bracket, so a line of 100,000 of them ends in
a RecursionError. Dots in a key make tables as deep, in which other code would end so.
"""

import re
import tomllib
from contextlib import suppress
from typing import Any

TOMLDecodeError = tomllib.TOMLDecodeError

#: Tables and lists one inside the other; a settings file needs four.
DEEPEST = 100
#: what may stand around a value whose quotes are wrong
_QUOTES = "\"'\u201c\u201d\u201e\u2018\u2019\u00ab\u00bb`"
#: what other languages write for nothing
_NOTHING = ("none", "null", "nil", "~", "undefined")


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


def meant(text: str, number: int, *, twice: bool = False) -> str:
    """Return what to write in a line that is no TOML, as a sentence; "" if unknown.

    number: of the line, from 1; 0 for the end of the text.  twice: whether it gives a
    value for the second time.
    """
    lines = text.split("\n")
    if not number:
        odd = [i for i, one in enumerate(lines, 1) if _is_open(one)]
        return f" Line {odd[0]} lacks a quote at its end." if odd else ""
    line = lines[number - 1].partition("#")[0].rstrip()
    key, _, value = line.partition("=")
    bare = value.strip().strip(_QUOTES)
    if twice:
        return _first(lines[: number - 1], key.strip())
    if bare.lower() in _NOTHING:
        return f" To leave {key.strip()} open, leave the line out."
    if re.fullmatch(r"[^{]*{[^{}]*", value):
        return f" Write all of {key.strip()} = {{ ... }} on one line."
    tries = [
        line.replace("==", "=", 1),
        re.sub(r"\s*//.*", "", line),
        re.sub(r"^(\s*\w+)\s*:", r"\1 =", line),
    ]
    if bare[:1].isalnum():
        number_in = re.sub(r"^(\d+),(\d+)", r"\1.\2", bare)
        tries += [f"{key}= {one}" for one in (number_in, bare.lower(), f'"{bare}"')]
    for one in tries:
        with suppress(TOMLDecodeError):
            if one != line and loads(one):
                return f" Write {' '.join(one.split())}."
    return ""


def _is_open(line: str) -> bool:
    return any(line.count(q) % 2 == 1 and q * 3 not in line for q in "'\"")


def _first(above: list[str], key: str) -> str:
    """Return where a key of this table has its first value."""
    for number in range(len(above), 0, -1):
        line = above[number - 1]
        if line.partition("=")[0].strip() == key:
            return f" {key} has a value in line {number} already; keep one of the two."
        if line.lstrip().startswith("["):
            return ""
    return ""

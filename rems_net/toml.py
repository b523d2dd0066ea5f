"""TOML of files and command lines: every mistake is one kind of error.

Python's own reader is recursive, so a line of 100,000 brackets ends in a
RecursionError. Dots in a key make equally deep tables, which would break other code.
"""

import re
import tomllib
from contextlib import suppress
from datetime import date, time
from typing import Any

TOMLDecodeError = tomllib.TOMLDecodeError

#: levels of tables and lists. A settings file needs four.
DEEPEST = 100
#: characters around a value with wrong quotes
_QUOTES = "\"'\u201c\u201d\u201e\u2018\u2019\u00ab\u00bb`"
#: words of other languages for no value
_NOTHING = ("none", "null", "nil", "~", "undefined")


def loads(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text. Raises TOMLDecodeError."""
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


def value_of(text: str) -> Any:
    """Return a value as in a TOML file; other text is text, such as 130 mm."""
    try:
        value = loads(f"value = {text}")["value"]
    except TOMLDecodeError:
        return text
    # No field has the type of a date.
    return text if isinstance(value, date | time) else value


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
    """Return where the brackets get too deep, in the words of Python's errors."""
    depth = 0
    for number, line in enumerate(text.split("\n"), 1):
        for column, letter in enumerate(line, 1):
            depth += (letter in "[{") - (letter in "]}")
            if depth > DEEPEST:
                return f"line {number}, column {column}"
    return "end of document"


def meant(text: str, number: int, *, twice: bool = False) -> str:
    """Return a sentence with a correction of a line that is no TOML; "" if unknown.

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
    """Return a sentence about where a key of this table has its first value."""
    for number in range(len(above), 0, -1):
        line = above[number - 1]
        if line.partition("=")[0].strip() == key:
            return f" {key} has a value in line {number} already; keep one of the two."
        if line.lstrip().startswith("["):
            return ""
    return ""

"""Shapes: checks of received values. Each raises WireError.

No value that came over the network is used before it has passed these checks.
"""

import re
from collections.abc import Mapping
from math import isfinite
from typing import Any

from rems_net.agents.about.wiring import is_source
from rems_net.errors import ExperimentError, WireError
from rems_net.router.keys import KINDS, check_name

_DIGEST = re.compile(r"[0-9a-f]{16}")


def wrong(what: str, value: object, expected: str) -> WireError:
    """Return the error for a value that does not fit."""
    return WireError(f"{what} is {value!r:.80}; expected {expected}. (R0621)")


def whole(value: Any, what: str, low: int = 0, high: int = 2**53) -> int:
    """Return a whole number in [low, high]."""
    if type(value) is not int or not low <= value <= high:
        raise wrong(what, value, f"a whole number from {low} to {high}")
    return value


def real(value: Any, what: str, low: float = 0.0, high: float = 1e15) -> float:
    """Return a finite number in [low, high]."""
    if type(value) is not float or not isfinite(value) or not low <= value <= high:
        raise wrong(what, value, f"a number from {low:g} to {high:g}")
    return value


def flag(value: Any, what: str) -> bool:
    """Return true or false."""
    if type(value) is not bool:
        raise wrong(what, value, "true or false")
    return value


def text(value: Any, what: str, longest: int) -> str:
    """Return text that may be shown: no control characters, so no escape sequences."""
    if type(value) is not str or len(value) > longest or not value.isprintable():
        raise wrong(what, value, f"at most {longest} printable characters")
    return value


def shown(value: Any, what: str, longest: int) -> str:
    """Return text of several lines, with control characters replaced."""
    if type(value) is not str or len(value) > longest:
        raise wrong(what, value, f"at most {longest} characters of text")
    return "".join(c if c.isprintable() or c == "\n" else "?" for c in value)


def items(value: Any, what: str, longest: int) -> list[Any]:
    """Return a list of at most `longest` items."""
    if type(value) is not list or len(value) > longest:
        raise wrong(what, value, f"a list of at most {longest}")
    return value


def pair(value: Any, what: str, expected: str) -> list[Any]:
    """Return a list of two items. expected: what they are."""
    if type(value) is not list or len(value) != 2:
        raise wrong(what, value, expected)
    return value


def table(value: Any, what: str, longest: int) -> dict[str, Any]:
    """Return a map of text to values, with at most `longest` entries."""
    if (
        type(value) is not dict
        or len(value) > longest
        or not all(type(k) is str for k in value)
    ):
        raise wrong(what, value, f"a map of at most {longest} words")
    return value


def fields(value: Any, what: str, *names: str) -> Mapping[str, Any]:
    """Return a map with exactly these keys."""
    if type(value) is not dict or value.keys() != set(names):
        raise wrong(what, value, f"a map of {', '.join(names)}")
    return value


def name(value: Any, what: str) -> str:
    """Return one chunk of a key."""
    try:
        return check_name(value, what)
    except ExperimentError as error:
        raise WireError(str(error)) from None


def agent_key(value: Any, what: str) -> str:
    """Return an agent's key, such as `robot/sim`."""
    kind, slash, rest = value.partition("/") if type(value) is str else ("", "", "")
    if not slash or kind not in KINDS or kind == "clock":
        raise wrong(what, value, "<kind>/<name>, such as 'robot/sim'")
    name(rest, what)
    return str(value)


def host_name(value: Any, what: str) -> str:
    """Return the name of a process: `robot/sim`, or one chunk."""
    if type(value) is str and "/" in value:
        return agent_key(value, what)
    return name(value, what)


def source(value: Any, what: str, longest: int) -> str:
    """Return a source: `input/keys`, `robot/sim/state`, or a glob over both."""
    if not is_source(text(value, what, longest)):
        raise wrong(what, value, "a source, such as 'robot/sim/state'")
    return str(value)


def digest(value: Any, what: str) -> str:
    """Return a digest of sixteen hexadecimal digits."""
    if type(value) is not str or not _DIGEST.fullmatch(value):
        raise wrong(what, value, "a digest of 16 hexadecimal digits")
    return value

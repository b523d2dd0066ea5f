"""How a draft writes Python: calls, paths and texts, as ruff has them."""

import json
import os
from collections.abc import Iterable
from pathlib import Path

WIDTH = 88


def lines(spaces: int, lines: Iterable[str]) -> str:
    """Return the lines as one text, so far from the edge."""
    return "\n".join(" " * spaces + line for line in lines)


def wrapped(name: str, told: list[str], spaces: int, end: str = "") -> str:
    """Return a call, in one line or in one for each word, as ruff has them."""
    edge = " " * spaces
    whole = f"{edge}{name}({', '.join(told)}){end}"
    if len(whole) <= WIDTH and "#" not in whole:
        return whole
    words = (",  #".join(one.split("  #")) if "#" in one else f"{one}," for one in told)
    return "\n".join([f"{edge}{name}(", lines(spaces + 4, words), f"{edge}){end}"])


def brief(number: float) -> float:
    """Return a number with two digits."""
    return float(f"{number:.2g}")


def path(path: Path) -> str:
    """Return how a script in this folder names a path."""
    try:
        return text(Path(os.path.relpath(path)).as_posix())
    except ValueError:  # on another drive
        return text(path.absolute().as_posix())


def text(text: str) -> str:
    """Return how a script writes a text; a file of anybody's says what is in it."""
    # Behind a # there are our own words, see wrapped().
    return json.dumps(text, ensure_ascii=False).replace("#", r"\u0023")

"""Writing: formats the Python code of a draft, as ruff would."""

import json
import os
from collections.abc import Iterable
from pathlib import Path

WIDTH = 88


def lines(spaces: int, lines: Iterable[str]) -> str:
    """Return the lines as one text, indented by `spaces`."""
    return "\n".join(" " * spaces + line for line in lines)


def wrapped(name: str, told: list[str], spaces: int, end: str = "") -> str:
    """Return a call in one line, or with a line for each argument, as ruff does."""
    edge = " " * spaces
    whole = f"{edge}{name}({', '.join(told)}){end}"
    if len(whole) <= WIDTH and "#" not in whole:
        return whole
    words = (",  #".join(one.split("  #")) if "#" in one else f"{one}," for one in told)
    return "\n".join([f"{edge}{name}(", lines(spaces + 4, words), f"{edge}){end}"])


def brief(number: float) -> float:
    """Return a number rounded to two digits."""
    return float(f"{number:.2g}")


def path(path: Path) -> str:
    """Return the code for a path, relative to the working folder."""
    try:
        return text(Path(os.path.relpath(path)).as_posix())
    except ValueError:  # on another drive
        return text(path.absolute().as_posix())


def text(text: str) -> str:
    """Return the code for a text, which may come from any file."""
    # A # would be taken for the comments that wrapped() looks for.
    return json.dumps(text, ensure_ascii=False).replace("#", r"\u0023")

"""Plain values of a script, sent to its agents, so that they see its changes.

A process that imports a file has the values of its first lines, not those that a script
has set since: a `gain` that a loop sets before each `run()`.
"""

import ast
import sys
from collections.abc import Iterable
from enum import Enum
from math import isfinite
from pathlib import Path
from types import ModuleType

#: file, name in it (`gain`, `Hand.gain`), and value
Row = tuple[str, str, str]

#: Characters of a value; longer ones are not sent.
LONGEST = 500


def plain(value: object) -> str | None:
    """Return a number, text, flag, None or tuple of them, as Python code; or None."""
    found = None
    if isinstance(value, tuple):
        parts = [plain(part) for part in value[:LONGEST]]
        known = [part for part in parts if part is not None]
        if len(known) == len(value):
            found = f"({', '.join(known)}{',' * (len(known) == 1)})"
    elif isinstance(value, float):  # also numpy's
        found = repr(float(value)) if isfinite(value) else None
    elif isinstance(value, int) and not isinstance(value, Enum):
        found = repr(value) if abs(value) < 1 << 256 else None
    elif value is None or type(value) is str:
        found = repr(value)
    return found if found is not None and len(found) <= LONGEST else None


def adopt(rows: Iterable[Row]) -> None:
    """Set the values that differ from `rows` in the files of this process."""
    modules: dict[str, ModuleType | None] = {}
    for file, name, value in rows:
        if file not in modules:
            modules[file] = _module(Path(file))
        holder: object = modules[file]
        *outer, last = name.split(".")
        for part in outer:
            holder = getattr(holder, part, None)
        if holder is not None and plain(vars(holder).get(last, ...)) != value:
            setattr(holder, last, ast.literal_eval(value))


def _module(file: Path) -> ModuleType | None:
    """Return the module that was read from `file` in this process."""
    for module in list(sys.modules.values()):
        path = getattr(module, "__file__", None)
        if path and Path(path).name == file.name and Path(path).resolve() == file:
            return module
    return None

"""Plain values of a script, told to its agents, so that they see what they miss.

A process that reads a script anew does not see what the script has changed since: a
`gain` that a loop sets before each `run()`. It is told what its agents' code uses, as
it is in the starting process, and names the differences.
"""

from __future__ import annotations

import ast
import math
import sys
from collections.abc import Iterator, Sequence
from enum import Enum
from pathlib import Path
from types import ModuleType

#: file, name in it (`gain`, `Hand.gain`), value, and what to do about it
Row = tuple[str, str, str, str]

#: letters of a value; longer ones are not compared
LONGEST = 500
#: letters of a value that are shown
SHOWN = 40
#: calls that give the same wherever they are made; of anything else nobody knows
PURE = {"abs", "bool", "float", "int", "len", "list", "max", "min", "round", "str"}
PURE |= {"enumerate", "input", "range", "reversed", "sorted", "sum", "tuple", "zip"}
PURE |= {"math", "np", "numpy", *dir(math)}


def plain(value: object) -> str | None:
    """A number, text, flag, None or a tuple of them, as Python writes it; else None."""
    found = None
    if isinstance(value, tuple):
        parts = [plain(part) for part in value[:LONGEST]]
        known = [part for part in parts if part is not None]
        if len(known) == len(value):
            found = f"({', '.join(known)}{',' * (len(known) == 1)})"
    elif isinstance(value, float):  # numpy's, too
        found = repr(float(value))
    elif isinstance(value, int) and not isinstance(value, Enum):
        found = repr(value) if abs(value) < 1 << 256 else None
    elif value is None or type(value) is str:
        found = repr(value)
    return found if found is not None and len(found) <= LONGEST else None


def differences(rows: Sequence[Row]) -> Iterator[str]:
    """Say in a sentence each what differs here from what `rows` say."""
    modules: dict[str, ModuleType | None] = {}
    for file, name, there, advice in rows:
        if file not in modules:
            modules[file] = _module(Path(file))
        module = modules[file]
        if module is None:
            continue
        known, value = _find(module, name)
        here = plain(value) if known else "not there"
        if here is None or here == there:
            continue
        if known and name.rpartition(".")[2] in _varying(Path(file)):
            continue
        yield (
            f"{name} is {_short(there)} in {Path(file).name} where it was started, "
            f"and {_short(here)} in its agents: they are processes that read the file "
            f"anew, up to its first run(). {advice}"
        )


def _short(text: str) -> str:
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."


def _module(file: Path) -> ModuleType | None:
    """The module that was read from `file` in this process."""
    for module in list(sys.modules.values()):
        path = getattr(module, "__file__", None)
        if path and Path(path).name == file.name and Path(path).resolve() == file:
            return module
    return None


def _find(module: ModuleType, name: str) -> tuple[bool, object]:
    """Whether the name is there, and its value."""
    found: object = module
    for part in name.split("."):
        if part not in vars(found):
            return False, None
        found = vars(found)[part]
    return True, found


def _varying(file: Path) -> set[str]:
    """Names that may come out otherwise whenever the file is read: times, draws, ids.

    By bare name; whatever is computed from one is one, too.
    """
    try:
        tree = ast.parse(file.read_bytes())
    except (OSError, ValueError, SyntaxError):
        return set()
    shared = {n for g in ast.walk(tree) if isinstance(g, ast.Global) for n in g.names}
    made = list(_assigned(tree, shared, inside=False))
    varying = {"__name__", "__file__", "__spec__", "environ"}
    grown = -1
    while grown != len(varying):
        grown = len(varying)
        varying |= {name for name, value in made if _varies(value, varying)}
    return varying


def _assigned(
    node: ast.AST, shared: set[str], *, inside: bool
) -> Iterator[tuple[str, ast.expr]]:
    """Each name and attribute that something is assigned to, without local names."""
    targets: list[ast.expr] = []
    if isinstance(node, ast.Assign):
        targets = node.targets
    elif isinstance(node, ast.AnnAssign | ast.AugAssign | ast.NamedExpr | ast.For):
        targets = [node.target]
    value = getattr(node, "iter" if isinstance(node, ast.For) else "value", None)
    for one in (one for target in targets for one in ast.walk(target)):
        if value is None:  # `count: int`
            break
        if isinstance(one, ast.Name) and (not inside or one.id in shared):
            yield one.id, value
        elif isinstance(one, ast.Attribute):
            yield one.attr, value
    inside = inside or isinstance(node, ast.FunctionDef)
    for child in ast.iter_child_nodes(node):
        yield from _assigned(child, shared, inside=inside)


def _varies(value: ast.expr, varying: set[str]) -> bool:
    for node in ast.walk(value):
        if isinstance(node, ast.Name) and node.id in varying:
            return True
        if isinstance(node, ast.Attribute) and node.attr in varying:
            return True
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func).split(".")
            if called[0] not in PURE or "random" in called:
                return True
    return False

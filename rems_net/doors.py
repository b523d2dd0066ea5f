"""Front doors: packages that offer names of other modules, imported at first use."""

import re
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from types import ModuleType

from rems_net.errors import nearest

#: where a program finds all public names
DOORS = (
    "rems_net",
    "rems_net.units",
    "rems_net.bodies",
    "rems_net.drivers",
    "rems_net.gym",
)
_ALL = f" All public names are in {', '.join(DOORS[:-1])} and {DOORS[-1]}."


#: an import of public names, in one line or in brackets; and such a name
_IMPORT = re.compile(r"^ +from (\S+) import (\([^)]*\)|.*)$", re.MULTILINE)
_PUBLIC = re.compile(r"\b(\w+) as \1\b")


@cache
def homes(package: str) -> dict[str, str]:
    """Return the module of each public name of a package.

    The package has them as imports for type checkers, `from module import X as X`. They
    are read as text: to parse it as Python takes 10 ms at the start of each program.
    """
    path = str(vars(sys.modules[package])["__file__"])
    with open(path, encoding="utf-8") as file:  # noqa: PTH123 - pathlib takes 5 ms
        found = _IMPORT.findall(file.read())
    return {name: home for home, names in found for name in _PUBLIC.findall(names)}


def door(package: str) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package that offers names of others."""

    def getattribute(name: str) -> object:
        if f"{package}.{name}" in DOORS:
            return import_module(f"{package}.{name}")
        of = homes(package)
        if name == "__all__":
            return sorted(of)
        if name not in of:
            # Python uses `name` and `obj` to suggest the nearest name.
            raise AttributeError(
                f"module {package!r} has no attribute {name!r}",
                name=name,
                obj=sys.modules[package],
            )
        # Found from now on without this function.
        value: object = getattr(import_module(of[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return sorted([*vars(sys.modules[package]), *homes(package)])

    return getattribute, names


def missing(error: BaseException) -> str:
    """Return what to write in place of a name or module that rems_net lacks; or ""."""
    if isinstance(error, ImportError):
        found = re.match("cannot import name '(.*?)'", str(error))
        module, name = error.name or "", found[1] if found else ""
    elif isinstance(error, AttributeError) and isinstance(error.obj, ModuleType):
        module, name = error.obj.__name__, error.name or ""
    else:
        return ""
    if module.partition(".")[0] != "rems_net":
        return ""
    if name:
        return _no_name(module, name)
    return f"There is no module {module}.{nearest(module, DOORS) or _ALL}"


def _no_name(module: str, name: str) -> str:
    from difflib import get_close_matches  # takes 2 ms to load

    doors = {n: door for door in reversed(DOORS) for n in import_module(door).__all__}
    lacks = f"{module} has no {name!r}."
    if name in doors:
        return f"{lacks} Write: from {doors[name]} import {name}"
    known = [n for n in doors if doors[n] == module]
    close = get_close_matches(name, known, 1) or get_close_matches(name, doors, 1)
    if not close:
        return f"{lacks}{_ALL}"
    return f"{lacks} Did you mean: from {doors[close[0]]} import {close[0]}?"

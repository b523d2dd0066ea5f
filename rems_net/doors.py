"""Front doors: packages that offer names of other modules, imported at first use."""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module


def door(
    package: str, homes: Mapping[str, str]
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package that offers names of others.

    homes: module -> its public names, with blanks between them
    """
    of = {name: module for module, names in homes.items() for name in names.split()}

    def getattribute(name: str) -> object:
        if name not in of:
            # Python uses `name` and `obj` to suggest the nearest name.
            raise AttributeError(
                f"module {package!r} has no attribute {name!r}",
                name=name,
                obj=sys.modules[package],
            )
        return getattr(import_module(of[name]), name)

    def names() -> list[str]:
        return sorted([*vars(sys.modules[package]), *of])

    return getattribute, names

"""Front doors: packages that offer names of other modules, imported when first used."""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module


def door(
    package: str, homes: Mapping[str, str]
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package that offers names of others.

    homes: module -> public names that it defines, with blanks between them
    """
    of = {name: module for module, names in homes.items() for name in names.split()}

    def getattribute(name: str) -> object:
        if name not in of:
            # The two names let Python say which was meant.
            raise AttributeError(
                f"module {package!r} has no attribute {name!r}",
                name=name,
                obj=sys.modules[package],
            )
        return getattr(import_module(of[name]), name)

    def names() -> list[str]:
        return sorted([*vars(sys.modules[package]), *of])

    return getattribute, names

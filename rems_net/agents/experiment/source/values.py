"""Plain values in the user's own files that the code of agents uses."""

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

from rems_net.agents.experiment.source.code import functions, instructions
from rems_net.agents.protocol.plan import Plan
from rems_net.agents.protocol.values import Row, plain
from rems_net.uncaught import is_users

#: Number of values that a host gets.
MOST = 200
#: Number of functions and classes that are searched per class.
DEEP = 2000


def values(plans: Sequence[Plan]) -> list[Row]:
    """Return the plain globals and class attributes that the agents of one host use.

    The values are the current ones of this process. Values that the agents themselves
    set are left out: a counter or a memory is no setting.
    """
    found: dict[tuple[str, str], Row] = {}
    for cls in dict.fromkeys(cls for plan in plans for cls in plan.classes):
        for row in _Search(cls).found():
            found.setdefault(row[:2], row)
    return list(found.values())[:MOST]


class _Search:
    """Follows the code of a class: the functions it calls, and the names they use."""

    def __init__(self, cls: type):
        self.rows: dict[tuple[str, str], str] = {}
        self.loads: set[str] = set()
        #: attributes and globals that the code itself sets
        self.stores: set[str] = set()
        self.sets: set[str] = set()
        self.modules: dict[str, ModuleType] = {}
        #: other classes: of these, only attributes that are named somewhere count
        self.classes: dict[type, bool] = {}
        self._seen: set[object] = set()
        self._class(cls, whole=True)
        self._modules()

    def found(self) -> Iterable[Row]:
        """Yield file, name and value of all that is used."""
        for cls, whole in self.classes.items():
            file = getattr(sys.modules.get(cls.__module__), "__file__", None)
            if is_users(file) and "<" not in cls.__qualname__:
                names = vars(cls).keys() if whole else self.loads
                self._take(str(file), vars(cls), names, f"{cls.__qualname__}.")
        for (file, name), value in self.rows.items():
            bare = name.rpartition(".")[2]
            if bare not in (self.sets if bare == name else self.stores):
                yield file, name, value

    def _take(
        self,
        file: str,
        names: Mapping[str, object],
        wanted: Iterable[str],
        before: str = "",
    ) -> None:
        path = str(Path(file).resolve())
        for name in wanted:
            if name in names and not name.startswith("__"):
                value = plain(names[name])
                if value is not None:
                    self.rows[path, before + name] = value

    def _class(self, cls: type, *, whole: bool) -> None:
        for base in cls.__mro__:
            if base not in self.classes and len(self.classes) < DEEP:
                self.classes[base] = whole
                for function in functions(base):
                    self._function(function)

    def _modules(self) -> None:
        """Follow names that are used of modules: `config.most()`."""
        before = -1
        while before != len(self.loads) + len(self.modules):
            before = len(self.loads) + len(self.modules)
            for module in list(self.modules.values()):
                around = vars(module)
                for name in self.loads & around.keys():
                    self._global(around, name, around[name])

    def _function(self, function: FunctionType) -> None:
        if function in self._seen or len(self._seen) > DEEP:
            return
        self._seen.add(function)
        around = function.__globals__
        for what, name, _ in instructions(function.__code__):
            if what == "STORE_ATTR":
                self.stores.add(name)
            elif what == "STORE_GLOBAL":
                self.sets.add(name)
            elif what in ("LOAD_ATTR", "LOAD_METHOD"):
                self.loads.add(name)
            elif what in ("LOAD_GLOBAL", "LOAD_NAME") and name in around:
                self._global(around, name, around[name])

    def _global(self, around: dict[str, Any], name: str, value: object) -> None:
        if isinstance(value, ModuleType):
            if is_users(getattr(value, "__file__", None)):
                self.modules[value.__name__] = value
        elif isinstance(value, FunctionType):
            if is_users(value.__code__.co_filename):
                self._function(value)
        elif isinstance(value, type):
            self._class(value, whole=False)
        elif is_users(around.get("__file__")):
            self._take(str(around["__file__"]), around, [name])

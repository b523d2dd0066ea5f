"""Parts by name: the built-in ones, and those of installed packages.

A package brings a part by an entry point, in its pyproject.toml:

    [project.entry-points."rems_net.drivers"]
    lagging = "my_parts.lagging:Lagging"

Nothing of it is imported before its name is used. Another process gets the class by
module and name (`reference`), so it never looks for entry points.
"""

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from rems_net.agents import registry
from rems_net.agents.agent import Agent, Input, Output, Process
from rems_net.agents.robot import Definition, Driver
from rems_net.agents.world import World
from rems_net.errors import ExperimentError, RemsError, nearest

if TYPE_CHECKING:
    from importlib.metadata import Distribution, EntryPoint

#: kind of part -> base class
BASES: dict[str, type[Agent]] = {
    "definition": Definition,
    "driver": Driver,
    "input": Input,
    "process": Process,
    "output": Output,
    "world": World,
}
#: group of entry points -> kind of part
GROUPS = {
    "rems_net.definitions": "definition",
    "rems_net.drivers": "driver",
    "rems_net.inputs": "input",
    "rems_net.processes": "process",
    "rems_net.outputs": "output",
}
#: origin of the built-in parts
OURS = "rems_net itself"


@dataclass(frozen=True, slots=True)
class Part:
    """A named class, and the package that brings it: nothing is loaded yet."""

    kind: str
    name: str
    #: `module:Class`
    reference: str
    #: a distribution and its version, or `OURS`
    origin: str
    #: problem of its entry point that can be seen without loading it; or ""
    problem: str = ""

    def load(self) -> type[Agent]:
        """Import the class. Raises ExperimentError naming this part, and the cause."""
        try:
            if self.problem:
                raise ExperimentError(f"{self.problem} (R0425)")
            return checked(self.kind, registry.load(self.reference, Path()))
        except RemsError as error:
            if self.origin == OURS:
                raise
            raise ExperimentError(
                f"The {self.kind} {self.name!r} of {self.origin} cannot be used: "
                f"{error}"
            ) from None


def find(kind: str, name: object, folder: Path) -> type[Agent]:
    """Return the class of a part's name, `file.py:Class` or `module:Class`.

    folder: the base of a relative file name. Raises ExperimentError.
    """
    if isinstance(name, type):
        return checked(kind, name)
    if isinstance(name, Agent):
        called = type(name).__name__
        raise ExperimentError(
            f"{kind} is an instance of {called}; expected the class itself, which is "
            f"built in a process of its own: write {called}, without parentheses."
            " (R0426)"
        )
    if not isinstance(name, str):
        example = next(iter(registry.BUILT_IN[kind]), "my_file.py:MyClass")
        raise ExperimentError(
            f"{kind} is {name!r}; expected a name, such as {example!r}, or a class."
            " (R0426)"
        )
    if ":" in name:
        return checked(kind, registry.load(name, folder))
    known = by_name(kind)
    if name not in known:
        if isinstance(getattr(sys.modules.get("__main__"), name, None), type):
            raise ExperimentError(
                f"{kind} is {name!r}, a class of this script: write {name}, without "
                "quotes. (R0426)"
            )
        have = ", ".join(known) or "none built in"
        hint = nearest(name, known)
        for other in registry.BUILT_IN:
            if name in registry.BUILT_IN[other]:
                hint = f" {name!r} is a {other}: a robot has its definition first."
        raise ExperimentError(
            f"There is no {kind} {name!r}; there is {have}, or your own as "
            f"'my_file.py:MyClass'.{hint} (R0425)"
        )
    first, *others = known[name]
    if others:
        both = " and ".join(f"{p.reference!r} of {p.origin}" for p in known[name])
        raise ExperimentError(
            f"There is more than one {kind} {name!r}: {both}. Uninstall one, or write "
            "the one you mean in place of its name. (R0425)"
        )
    return first.load()


def checked(kind: str, cls: type) -> type[Agent]:
    """Return `cls`, if it is of that kind. Raises ExperimentError."""
    base = BASES[kind]
    if not issubclass(cls, base):
        raise ExperimentError(
            f"{cls.__name__} is no {kind}; expected a subclass of {base.__name__}."
            " (R0426)"
        )
    return cls


def by_name(kind: str) -> dict[str, list[Part]]:
    """Return the parts of a kind by name: several if a name is taken twice."""
    found = {
        name: [Part(kind, name, reference, OURS)]
        for name, reference in registry.BUILT_IN[kind].items()
    }
    for part in brought()[0]:
        if part.kind == kind:
            found.setdefault(part.name, []).append(part)
    return found


def brought() -> tuple[list[Part], list[str]]:
    """Return the parts of installed packages, and a sentence per unreadable package."""
    return _scan(tuple(sys.path))


@lru_cache(maxsize=1)
def _scan(path: tuple[str, ...]) -> tuple[list[Part], list[str]]:
    """Search once per `sys.path`: it takes some milliseconds."""
    if not any(map(_may_bring, path)):
        return [], []
    from importlib.metadata import distributions

    parts: dict[str, list[Part]] = {}
    unreadable = []
    for found in distributions():
        try:
            points = [p for p in found.entry_points if p.group in GROUPS]
            if points and not _shadowed(found):
                name = re.sub(r"[-_.]+", "-", found.metadata["Name"]).lower()
                parts.setdefault(name, list(_parts(found, points)))
        except Exception as error:
            # Any program can write these files; a faulty package loses only its parts.
            where = found.locate_file("")
            unreadable.append(f"a package in {where} cannot be read: {error!r}")
    return [part for name in sorted(parts) for part in parts[name]], unreadable


def _may_bring(folder: str) -> bool:
    """Return whether a package there has one of our groups: ten times faster."""
    try:
        files = Path(folder).glob("*-info/entry_points.txt")
        # rems_net itself has the command `rems`, and none of these groups.
        return any("[rems_net." in file.read_text("utf-8") for file in files)
    except (OSError, UnicodeDecodeError):  # the full search reports it
        return True


def _shadowed(found: "Distribution") -> bool:
    """Return whether another version comes first, so this one is never imported."""
    from importlib.metadata import distribution

    first = distribution(found.metadata["Name"])
    return first.locate_file("") != found.locate_file("")


def _parts(found: "Distribution", points: "list[EntryPoint]") -> Iterator[Part]:
    origin = f"{found.metadata['Name']} {found.version}"
    for point in points:
        problem, kind = "", GROUPS[point.group]
        # Same pattern as in `importlib.metadata`; extras are obsolete.
        match = re.fullmatch(r"([\w.]+)\s*:\s*([\w.]+)\s*(\[.*\])?", point.value)
        if not match:
            problem = f"its entry point is {point.value!r}; expected 'module:Class'."
        elif ":" in point.name:
            problem = "a name has no ':'."
        reference = f"{match[1]}:{match[2]}" if match else point.value
        yield Part(kind, point.name, reference, origin, problem)


def reference(cls: type) -> str:
    """Return the reference by which `load` finds this class in another process.

    Raises ExperimentError for a class that another process cannot reach.
    """
    path = None
    if cls.__module__ == "__main__" or cls.__module__.startswith("rems_script:"):
        path = _file_of(cls)
        if path is None:
            raise ExperimentError(
                f"{cls.__name__} is in no file: it was typed at a prompt or in a cell, "
                "or came with -c or through a pipe, so the process of its agent cannot "
                "find it. Keep it in this program by host='here', or put it into a "
                f"file, such as mine.py, and write 'mine.py:{cls.__name__}'. A cell "
                "that begins with %%writefile mine.py writes that file. (R0427)"
            )
    if "<locals>" in cls.__qualname__:
        raise ExperimentError(
            f"{cls.__qualname__} is defined inside a function, where the process of "
            "its agent cannot find it; define it at the top of the file, or keep its "
            "agent in this program by host='here'. (R0427)"
        )
    where = cls.__module__ if path is None else str(path.resolve())
    return f"{where}:{cls.__qualname__}"


def _file_of(cls: type) -> Path | None:
    """Return the file that a script's class is in; None for one that is in none."""
    named = getattr(sys.modules.get(cls.__module__), "__file__", None)
    # At the prompt after `python -i FILE` only the command line names the file.
    path = Path(named or sys.argv[0])
    if not path.is_file():  # "<stdin>"
        return None
    if named and not hasattr(sys, "ps1"):  # there is no prompt
        return path
    codes = [f.__code__ for f in vars(cls).values() if hasattr(f, "__code__")]
    if codes:
        files = [Path(code.co_filename).resolve() for code in codes]
        return path if path.resolve() in files else None
    text = path.read_text(encoding="utf-8", errors="replace")
    return path if f"class {cls.__name__}" in text else None

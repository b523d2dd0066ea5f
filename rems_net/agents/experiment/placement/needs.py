"""Needs: the files without which an agent can't live on another machine."""

import ast
import hashlib
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path, PurePath

from rems_net.agents.agent import Agent
from rems_net.agents.parts import reference
from rems_net.agents.protocol.placement import DATA, MODELS, file_name
from rems_net.defdict import DefDict
from rems_net.errors import ExperimentError, WireError
from rems_net.uncaught import is_users


def source_digest(source: bytes) -> str:
    """Return the SHA-256 of a source with LF line ends: Git changes them on Windows."""
    return hashlib.sha256(source.replace(b"\r\n", b"\n")).hexdigest()


# -- code: it stays where it is ------------------------------------------------------


def carried(cls: type, folder: Path) -> tuple[str, Path | None]:
    """Return how another machine finds a class: `lab.py:Follow`, or `module:Class`.

    And its file, if it is the user's own. Raises ExperimentError for a file that is not
    below the experiment's folder.
    """
    where, _, name = reference(cls).rpartition(":")
    file = Path(where) if where.endswith(".py") else file_of(where)
    if file is None:
        return f"{where}:{name}", None
    return f"{_below(file, folder, ('py',), cls.__name__)}:{name}", file


def code_of(file: Path, folder: Path) -> dict[str, str]:
    """Return the digests of a source and of its imports from below the folder."""
    found: dict[str, str] = {}
    left = [file.resolve()]
    while left:
        path = left.pop()
        shown = path.relative_to(folder).as_posix()
        if shown not in found:
            source = path.read_bytes()
            found[shown] = source_digest(source)
            files = [file.resolve() for file in map(file_of, _imports(source)) if file]
            left += [path for path in files if path.is_relative_to(folder)]
    return found


@lru_cache(maxsize=64)
def _imports(source: bytes) -> tuple[str, ...]:
    """Return the names that a source imports; a sweep asks for the same at each run."""
    names: list[str] = []
    with suppress(SyntaxError, ValueError):
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.Import):
                names += [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module:
                inner = [f"{node.module}.{alias.name}" for alias in node.names]
                names += [node.module, *inner]
    return tuple(names)


def file_of(module: str) -> Path | None:
    """Return the source of a loaded module, if it is the user's own; else None."""
    file = getattr(sys.modules.get(module), "__file__", None) or ""
    return Path(file) if file.endswith(".py") and is_users(file) else None


# -- data: it travels ----------------------------------------------------------------


def data_of(agent: Agent, folder: Path) -> dict[str, Path]:
    """Return the files that an agent's settings name, by their names on the way.

    With a model of a robot or a world come the files beside it: it names its meshes
    itself. Raises ExperimentError for a file that is not below the folder.
    """
    found: dict[str, Path] = {}
    for value in texts(agent):
        try:
            path = (folder / value).resolve()
            if not value or not path.is_file():
                continue
        except (OSError, ValueError):  # the text cannot be a name
            continue
        name = _below(path, folder, DATA + MODELS, value)
        if "\\" in value or PurePath(value).as_posix() != name:
            raise ExperimentError(
                f"{value!r} is found on this machine only; write {name!r}. (R0440)"
            )
        found[name] = path
        if path.suffix[1:].lower() in MODELS:
            found |= _beside(path.parent, folder)
    return found


def texts(agent: Agent) -> Iterator[str]:
    """Yield the settings of an agent that are text: some name files."""
    for slot in ("options", "parameters"):
        settings = agent.__dict__.get(slot)
        if isinstance(settings, DefDict):
            for path in settings.schema.paths:
                if type(value := settings[path]) is str:
                    yield value


def _beside(here: Path, folder: Path) -> dict[str, Path]:
    found = {}
    for path in sorted(here.rglob("*")):
        if path.suffix[1:].lower() in (*MODELS, "png") and path.is_file():
            with suppress(ExperimentError):  # hidden, or a link to another folder
                found[_below(path, folder, (*MODELS, "png"), path.name)] = path
    return found


def _below(path: Path, folder: Path, suffixes: tuple[str, ...], what: str) -> str:
    """Return the name of a file below the folder. Raises ExperimentError."""
    try:
        name = path.resolve().relative_to(folder).as_posix()
    except ValueError:
        raise ExperimentError(
            f"{what} is {path}, which is not below the experiment's folder {folder}: "
            "another machine can't find it; put it there. (R0440)"
        ) from None
    try:
        return file_name(name, suffixes)
    except WireError as error:
        raise ExperimentError(f"{what} can't be had on another machine: {error}") from (
            None
        )

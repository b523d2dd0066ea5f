"""Optional libraries: loaded at first use, with a sentence if that fails."""

import platform
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from rems_net.errors import MissingPartError
from rems_net.uncaught import hiding

#: system and newest Python for which PyBullet has wheels
WHEELS, NEWEST = ("linux", "x86_64"), (3, 11)
SYSTEMS = {"win32": "Windows", "darwin": "macOS"}


def no_wheels(
    library: str,
    system: tuple[str, str] | None = None,
    python: tuple[int, int] = sys.version_info[:2],
) -> str:
    """Return why pip cannot install a library here, and what to use; "" if it can."""
    system = system or (sys.platform, platform.machine())
    if library != "pybullet" or (system == WHEELS and python <= NEWEST):
        return ""
    name = SYSTEMS.get(system[0], " ".join(system))
    if system == WHEELS:
        major, minor = NEWEST
        return (
            f"PyBullet has no wheels for Python {python[0]}.{python[1]}; "
            f"use {major}.{minor}, or mujoco."
        )
    return f"PyBullet has no wheels for {name}; use mujoco."


def look_for(library: str, extra: str) -> None:
    """Raise MissingPartError if an optional library is not installed. Loads nothing."""
    if find_spec(library) is None:
        raise MissingPartError(
            f"{lack} (R0301)"
            if (lack := no_wheels(library))
            else f"This needs the library {library}, which is not "
            f'installed. Type: pip install "rems-net[{extra}]" (R0301)'
        )


def load(library: str, extra: str) -> Any:
    """Import an optional library. Raises MissingPartError with the reason."""
    look_for(library, extra)
    try:
        return import_module(library)
    except ImportError as why:
        raise MissingPartError(
            hiding(why)
            or f"The library {library} is installed but cannot be loaded: {why}. "
            f'Type: pip install --force-reinstall "rems-net[{extra}]" '
            "(R0302)"
        ) from why


@contextmanager
def needed(library: str, extra: str, what: str = "This") -> Iterator[None]:
    """Turn a failing import in this block into a MissingPartError with the reason.

    what: that needs it, to begin a sentence.
    """
    try:
        yield
    except ImportError as why:
        raise MissingPartError(
            hiding(why)
            or f"{what} needs {library}, which cannot be imported ({why}). Type: "
            f'pip install "rems-net[{extra}]" (R0301)'
        ) from why

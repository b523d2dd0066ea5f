"""Report of an error that a script does not catch: its sentence, and the user's lines.

Python would show every line of the package on the way. Only errors that are bugs keep
those.
"""

import inspect
import os
import sys
import traceback
from collections.abc import Collection, Iterator
from functools import lru_cache
from pathlib import Path
from types import TracebackType

from rems_net.doors import missing
from rems_net.errors import RemsError

_PACKAGE = Path(__file__).parent
_PYTHON = Path(os.__file__).parent
#: names that a user's file must not hide, beside Python's own modules
LIBRARIES = frozenset({"matplotlib", "msgpack", "mujoco", "numpy", "pybullet"})
LIBRARIES |= {"PIL", "apriltag", "cv2", "gymnasium", "pandas", "pettingzoo", "polars"}
LIBRARIES |= {"pyarrow", "rich", "serial", "unyt", "websockets", "zenoh"}
NEEDED = sys.stdlib_module_names | LIBRARIES


def sentences(error: BaseException, trace: TracebackType | None) -> Iterator[str]:
    """Yield the report of an error, line by line; nothing if Python's is better."""
    frames = traceback.extract_tb(trace)
    ours = [f for f in frames if _PACKAGE in Path(f.filename).parents]
    if isinstance(error, KeyboardInterrupt):
        if ours:
            yield from getattr(error, "__notes__", ("Interrupted.",))
        return
    hider = _hider([f.filename for f in frames]) if _is_import(error) and ours else None
    lacks = missing(error) if hider is None else ""
    if hider is None and not lacks and not isinstance(error, RemsError):
        return
    users = [f for f in frames if is_users(f.filename)]
    # The line is enough, without the marks that some versions put below it.
    own = [(f.filename, f.lineno or 0, f.name, f.line) for f in users]
    yield from (line.rstrip("\n") for line in traceback.format_list(own))
    if hider is None:
        yield f"{type(error).__name__}: {lacks or error}"
    else:
        yield _hides(hider)


def hiding(error: BaseException) -> str:
    """Return the sentence for an error of a module that a user's file hides; or ""."""
    frames = traceback.extract_tb(error.__traceback__)
    hider = _hider([f.filename for f in frames]) if _is_import(error) else None
    return _hides(hider) if hider and repr(hider.stem) in str(error) else ""


def hiding_here(stems: Collection[str]) -> str:
    """Return the sentence if a user's file runs here as one of these modules; or ""."""
    frame = inspect.currentframe()
    while frame is not None:
        path = Path(frame.f_code.co_filename)
        name = frame.f_globals.get("__name__")
        if name == path.stem and name in stems and is_users(str(path)):
            return _hides(path)
        frame = frame.f_back
    return ""


def _hides(hider: Path) -> str:
    return (
        f"{hider.name} hides the module {hider.stem!r}, which rems_net needs. "
        f"Rename it, for example to my_{hider.name}. (R0312)"
    )


def _is_import(error: BaseException) -> bool:
    return isinstance(error, ImportError | AttributeError)


def _hider(places: list[str]) -> Path | None:
    """Return the user's file that was imported in place of a module of that name."""
    modules = [(n, getattr(m, "__file__", None)) for n, m in [*sys.modules.items()]]
    loaded = [file for name, file in modules if file and Path(file).stem == name]
    for path in map(Path, [*places, *loaded]):
        first = str(path.parent) in sys.path and is_users(str(path))
        if first and path.stem in NEEDED:
            return path
    return None


@lru_cache(maxsize=4096)
def is_users(filename: str | None) -> bool:
    """Return whether a file is neither ours, nor of a library, nor Python's own."""
    path = Path(filename or "")
    if not path.is_absolute() or {"site-packages", "dist-packages"} & {*path.parts}:
        return False
    return not {_PACKAGE, _PYTHON} & {*path.parents}

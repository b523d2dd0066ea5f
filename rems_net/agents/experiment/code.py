"""Code: which names the methods of a class use, found without running them."""

from __future__ import annotations

import dis
import sysconfig
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from types import CodeType, FunctionType

_PACKAGE = Path(__file__).parents[2]
_INSTALLED = tuple(
    Path(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib", "purelib")
)


@lru_cache(maxsize=4096)
def is_users(file: str | None) -> bool:
    """Whether a file is the user's own: not installed, and not of rems_net."""
    if not file or file.startswith("<"):
        return False
    path = Path(file).absolute()
    if {"site-packages", "dist-packages"} & set(path.parts):
        return False
    return not any(home in path.parents for home in (_PACKAGE, *_INSTALLED))


def functions(cls: type) -> Iterator[FunctionType]:
    """The functions in the body of a class that are the user's own."""
    for value in vars(cls).values():
        found = getattr(value, "__func__", None) or getattr(value, "fget", None)
        found = found or value
        if isinstance(found, FunctionType) and is_users(found.__code__.co_filename):
            yield found


def instructions(code: CodeType, me: str = "") -> Iterator[tuple[str, str, bool]]:
    """What is done with names: ("STORE_ATTR", "gain", True) is `self.gain = ...`.

    The last says whether it is done to the first argument. Functions inside included.
    """
    me = me or next(iter(code.co_varnames), "")
    before: object = None
    for one in dis.get_instructions(code):
        if one.opname == "LOAD_CONST":
            before = None
        elif one.opname.startswith(("LOAD_", "STORE_")):
            if isinstance(one.argval, str):
                yield one.opname, one.argval, before == me
            # Two loads in one instruction, since Python 3.13.
            before = one.argval[-1] if isinstance(one.argval, tuple) else one.argval
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from instructions(inner, me)

"""Code: the names that methods of a class use, found without running them."""

import dis
from collections.abc import Iterator
from types import CodeType, FunctionType

from rems_net.uncaught import is_users


def functions(cls: type) -> Iterator[FunctionType]:
    """Yield the functions in the body of a class that are the user's own."""
    for value in vars(cls).values():
        found = getattr(value, "__func__", None) or getattr(value, "fget", None)
        found = found or value
        if isinstance(found, FunctionType) and is_users(found.__code__.co_filename):
            yield found


def instructions(code: CodeType, me: str = "") -> Iterator[tuple[str, str, bool]]:
    """Yield uses of names: ("STORE_ATTR", "gain", True) is `self.gain = ...`.

    The last item is whether the first argument is used. Inner functions are included.
    """
    me = me or next(iter(code.co_varnames), "")
    before: object = None
    for one in dis.get_instructions(code):
        if one.opname == "LOAD_CONST":
            before = None
        elif one.opname.startswith(("LOAD_", "STORE_")):
            if isinstance(one.argval, str):
                yield one.opname, one.argval, before == me
            # Since Python 3.13, one instruction can load twice.
            before = one.argval[-1] if isinstance(one.argval, tuple) else one.argval
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from instructions(inner, me)


def dropped(code: CodeType) -> Iterator[tuple[list[str], int]]:
    """Yield attributes that a line only names: `self.verbs.reset` without `()`.

    Each is the names of the line, the last one first, and the line's number.
    """
    names, last = list[str](), ""
    for one in dis.get_instructions(code):
        if one.opname == "LOAD_ATTR":
            names.insert(0, str(one.argval))
        elif one.opname.startswith(("STORE_", "POP_", "RETURN_")):
            if one.opname == "POP_TOP" and last == "LOAD_ATTR":
                place = one.positions and one.positions.lineno
                yield names, place or code.co_firstlineno
            names = []
        last = one.opname
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from dropped(inner)

"""Lines: find the user's line that contains a mistake."""

import dis
import inspect
import traceback
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

from rems_net.agents.diagnosis import place, written
from rems_net.agents.experiment.source.code import functions
from rems_net.agents.robot import Driver, Robot
from rems_net.uncaught import is_users

#: Modules whose answers differ from run to run.
RESTLESS = {"random", "time", "uuid", "secrets", "datetime"}
#: Code to type instead of their functions.
REPEATABLE = "self.random.random()  # the robot's own; as often as it is run, the same"
#: Attributes that every robot has, also one of a user's class.
_PLAIN = {*vars(Driver("any"))}


def method(robot: object, *names: str) -> str:
    """Return the first of these methods that the user wrote, such as `Cart.drive
    (cart.py, line 12)`.

    If the user wrote none of them, return the first.
    """
    cls = robot if isinstance(robot, type) else type(robot)
    own = [name for name in names if _is_users(getattr(cls, name, None))]
    return written(cls, (own or names)[0])


def raised(error: BaseException) -> str:
    """Return where the error was raised; "" if not in the user's own code."""
    frames = traceback.extract_tb(error.__traceback__)
    return place(error) if any(is_users(f.filename) for f in frames) else ""


def restless(robot: Robot) -> str:
    """Return the first line with the time, or with random numbers without a seed."""
    for function in _functions(robot):
        for one, before in _pairs(function):
            name = one.argval
            if one.opname.startswith("LOAD_") and isinstance(name, str):
                found = function.__globals__.get(name)
                numpys = name == "random" and getattr(before, "__name__", "") == "numpy"
                if numpys or _is_restless(found, one.opname):
                    return _line(function, one)
    return ""


def unread(robot: Robot, name: str, argument: int) -> str:
    """Return the name of an argument that the user's method never reads; or "".

    argument: its index; self is 0
    """
    function = inspect.unwrap(getattr(type(robot), name))
    if not (isinstance(function, FunctionType) and _is_users(function)):
        return ""
    word = function.__code__.co_varnames[argument]
    for one in dis.get_instructions(function):
        words = one.argval if isinstance(one.argval, tuple) else (one.argval,)
        if one.opname.startswith("LOAD_") and word in words:
            return ""
    return word


def own_values(robot: Robot) -> dict[str, str]:
    """Return the plain attributes that the user's code has set, as text, by name."""
    return {
        name: repr(value)
        for name, value in vars(robot).items()
        if name.isidentifier()
        and name not in _PLAIN
        and name not in robot.ports()
        and isinstance(value, bool | int | float | str | list | dict | tuple | set)
    }


def setting(robot: Robot, names: Mapping[str, Any]) -> str:
    """Return the last line that sets one of these attributes on self, or ""."""
    found = ""
    for function in _functions(robot):
        for one, _ in _pairs(function):
            if one.opname == "STORE_ATTR" and one.argval in names:
                found = _line(function, one)
    return found


def shared(robot: Robot) -> tuple[str, str]:
    """Return name and text of a list, dict or set of a user's class; or "", ""."""
    for base in type(robot).__mro__:
        if not any(functions(base)):
            continue
        for name, value in vars(base).items():
            if isinstance(value, list | dict | set) and not name.startswith("__"):
                return f"{base.__name__}.{name}", repr(value)[:40]
    return "", ""


def _functions(robot: Robot) -> Iterator[FunctionType]:
    for base in reversed(type(robot).__mro__):
        yield from functions(base)


def _pairs(function: FunctionType) -> Iterator[tuple[dis.Instruction, object]]:
    """Yield each instruction, and the global that was loaded before it."""
    before: object = None
    for one in dis.get_instructions(function):
        yield one, before
        known = isinstance(one.argval, str)
        before = function.__globals__.get(one.argval) if known else None


def _is_restless(found: object, how: str) -> bool:
    if how not in ("LOAD_GLOBAL", "LOAD_NAME"):
        return False
    if isinstance(found, ModuleType):
        return found.__name__ in RESTLESS
    home = getattr(found, "__module__", None) or ""
    owner = type(getattr(found, "__self__", None)).__module__
    return callable(found) and (home in RESTLESS or owner in RESTLESS)


def _line(function: FunctionType, one: dis.Instruction) -> str:
    line = one.positions.lineno if one.positions else None
    code = function.__code__
    file = Path(code.co_filename).name
    return f"{file}, line {line or code.co_firstlineno}, in {code.co_name}"


def _is_users(found: object) -> bool:
    code = getattr(
        inspect.unwrap(found) if callable(found) else found, "__code__", None
    )
    return code is not None and is_users(code.co_filename)

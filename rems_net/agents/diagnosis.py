"""Diagnosis: the agent that failed, why, and at which line, in one line of text."""

import inspect
import sys
import threading
import traceback
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import NoReturn

from rems_net.agents.tick import Tick
from rems_net.doors import missing
from rems_net.errors import (
    AgentError,
    ExperimentError,
    RemsError,
    SchemaError,
    longer,
    nearest,
    uncoded,
)
from rems_net.uncaught import hiding, is_users

#: kind of agent -> the method that its user writes
OWN = {"input": "read", "process": "step", "output": "write"}


def failure(
    key: str,
    error: BaseException,
    n: int = 0,
    agents: Mapping[str, object] = MappingProxyType({}),
) -> tuple[str, str]:
    """Return the agent that failed, and the cause in one sentence.

    n: the tick in which it failed; 0 before the first.  agents: by key.
    """
    if isinstance(error, AgentError):
        return error.agent, error.cause
    return key, describe(error, n, agents.get(key))


def describe(error: BaseException, n: int = 0, agent: object = None) -> str:
    """Return what happened, at which line, and in which tick.

    An error of rems_net names its place itself, unless it was raised within a tick: if
    no line of the user's was at work, it is about a method's result.
    """
    if said := hiding(error):
        return said
    ours = isinstance(error, RemsError)
    stood = "" if ours and not n else place(error) or _returned(agent)
    cause = missing(error) or longer(error, _hint(error))
    what = str(error) if ours else f"{type(error).__name__}: {cause}"
    known = ("" if stood in what else stood, f"tick {n}" if n else "")
    where = ", ".join(part for part in known if part)
    return placed(what if what != uncoded(what) else f"{what} (R0520)", where)


def placed(sentence: str, where: str) -> str:
    """Return a sentence with a place in brackets, in front of the sentence's code."""
    return longer(sentence, f" ({where})" if where else "")


def _hint(error: BaseException) -> str:
    """Return a hint with the right names, if agents, ticks or values were misread."""
    if isinstance(error, ValueError) and "read-only" in str(error):
        return (
            "; the array of a field is set as a whole: copy it, change the copy, and "
            "set the field of an Out"
        )
    ticks = "; a tick has n (its number), t (its time in seconds) and dt"
    if isinstance(error, TypeError) and "'Tick'" in str(error):
        return ticks
    if not isinstance(error, AttributeError):
        return ""
    thing = error.obj
    if isinstance(thing, int | float):
        return (
            "; a field is a plain number, in the unit of its schema: convert "
            "it (math.degrees), or take value.quantity('heading').to('deg')"
        )
    if isinstance(thing, Tick):
        return ticks
    found = getattr(type(thing), "_found", None)
    ports = list(found) if isinstance(found, dict) else []
    if not ports:
        return ""
    return f"; its ports are {', '.join(ports)}{nearest(error.name, ports)}"


def place(error: BaseException) -> str:
    """Return the line that raised it; for a job's error, as its process reported.

    An error of rems_net has a place in the user's code only.
    """
    ours = isinstance(error, RemsError)
    notes: list[str] = getattr(error, "__notes__", [])
    if notes and not ours:
        return notes[-1]
    frames = traceback.extract_tb(error.__traceback__)
    users = [f for f in frames if is_users(f.filename)]
    last = [*([] if ours else frames), *users][-1:]
    return _place(last[0].filename, last[0].lineno, last[0].name) if last else ""


def _returned(agent: object) -> str:
    """Return the first line of the method that an input, process or output writes."""
    name = OWN.get(getattr(agent, "kind", ""), "")
    code = getattr(inspect.unwrap(getattr(type(agent), name, place)), "__code__", None)
    if code is None or not is_users(code.co_filename):
        return ""
    return _place(code.co_filename, code.co_firstlineno, name)


def written(owner: object, name: str) -> str:
    """Return a method and its first line: `Cart.derivative (cart.py, line 12)`."""
    cls = owner if isinstance(owner, type) else type(owner)
    of = next((base for base in cls.__mro__ if name in vars(base)), cls)
    code = getattr(inspect.unwrap(getattr(cls, name)), "__code__", None)
    if code is None:
        return f"{of.__name__}.{name}"
    file = Path(code.co_filename).name
    return f"{of.__name__}.{name} ({file}, line {code.co_firstlineno})"


def lacking(cls: type, kind: str, call: str) -> SchemaError:
    """Return the error of a class that does not write a method of its own.

    call: the method, such as `read(self, tick)`.
    """
    from difflib import get_close_matches  # takes 2 ms to load

    close = get_close_matches(call.partition("(")[0], vars(cls), 1)
    hint = f" It has {close[0]!r}: rename it." if close else ""
    return SchemaError(
        f"{cls.__name__} has no {call}, so the {kind} would do nothing.{hint} (R0501)"
    )


def check_call(owner: object, name: str, *words: str) -> None:
    """Refuse a method that does not take these arguments. Raises SchemaError."""
    function = getattr(owner, name)
    bound = getattr(function, "__func__", None)
    if not takes(bound or function, len(words) + (bound is not None)):
        own = inspect.signature(bound or function)
        raise SchemaError(
            f"{written(owner, name)} is `def {name}{own}`; expected "
            f"`def {name}({', '.join(('self', *words))})`. (R0502)"
        )


@lru_cache(maxsize=1024)
def takes(function: Callable[..., object], count: int, *words: str) -> bool:
    """Return whether a function takes `count` arguments, and others by these words.

    A crowd asks often.
    """
    try:
        inspect.signature(function).bind(*range(count), **dict.fromkeys(words))
    except TypeError:
        return False
    return True


def where(thread: threading.Thread | None = None) -> str:
    """Return the line at which a thread is: of the user's code, if possible.

    A function of ours that waits for a job has that in its variable `waits_for`.
    """
    stands = thread or threading.main_thread()
    innermost = sys._current_frames().get(stands.ident or 0)
    frame = innermost
    while frame is not None and not is_users(frame.f_code.co_filename):
        if isinstance(waits_for := frame.f_locals.get("waits_for"), str):
            return waits_for
        frame = frame.f_back
    frame = frame or innermost
    if frame is None:
        return ""
    return _place(frame.f_code.co_filename, frame.f_lineno, frame.f_code.co_name)


def _place(filename: str, line: int | None, function: str) -> str:
    return f"{Path(filename).name}, line {line}, in {function}"


def no_keyboard(prompt: object = "", /) -> NoReturn:
    """Refuse to wait for the keyboard. Raises ExperimentError, naming the line."""
    raise ExperimentError(
        "an agent cannot ask the keyboard, which is its script's "
        f"({where(threading.current_thread())}); ask before run(), and give it the "
        "answer as a setting. (R0430)"
    )

"""Diagnosis: who failed, why, and where the code stands, for people, in one line."""

from __future__ import annotations

import inspect
import sys
import threading
import traceback
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import NoReturn

from rems_net.errors import AgentError, ExperimentError, RemsError, SchemaError
from rems_net.uncaught import hiding, is_users


def failure(agent: str, error: BaseException) -> tuple[str, str]:
    """The agent that failed, and the cause in one sentence."""
    if isinstance(error, AgentError):
        return error.agent, error.cause
    return agent, describe(error)


def describe(error: BaseException) -> str:
    """What happened, and where; our own errors say it themselves."""
    if isinstance(error, RemsError):
        return str(error)
    if said := hiding(error):
        return said
    stood = place(error)
    return f"{type(error).__name__}: {error}" + (f" ({stood})" if stood else "")


def place(error: BaseException) -> str:
    """Where it was raised; in a job of another process, what that process said."""
    notes: list[str] = getattr(error, "__notes__", [])
    if notes:
        return notes[-1]
    frames = traceback.extract_tb(error.__traceback__)
    users = [f for f in frames if is_users(f.filename)]
    last = (users or frames)[-1] if frames else None
    return _place(last.filename, last.lineno, last.name) if last else ""


def written(owner: object, name: str) -> str:
    """`Cart.derivative (cart.py, line 12)`: a method, and where it begins."""
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
        f"{cls.__name__} has no {call}, so the {kind} would do nothing.{hint}"
    )


def check_call(owner: object, name: str, *words: str) -> None:
    """Refuse a method that does not take these words. Raises SchemaError."""
    function = getattr(owner, name)
    bound = getattr(function, "__func__", None)
    if not _takes(bound or function, len(words) + (bound is not None)):
        own = inspect.signature(bound or function)
        raise SchemaError(
            f"{written(owner, name)} is `def {name}{own}`; expected "
            f"`def {name}({', '.join(('self', *words))})`."
        )


@lru_cache(maxsize=1024)
def _takes(function: Callable[..., object], count: int) -> bool:
    """Whether a function can be called with so many words. A crowd asks often."""
    try:
        inspect.signature(function).bind(*range(count))
    except TypeError:
        return False
    return True


def where(thread: threading.Thread | None = None) -> str:
    """Where a thread stands, the main one by default: in the user's code, if it can."""
    stands = thread or threading.main_thread()
    innermost = sys._current_frames().get(stands.ident or 0)
    frame = innermost
    while frame is not None and not is_users(frame.f_code.co_filename):
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
        "answer as a setting."
    )

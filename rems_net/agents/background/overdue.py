"""Overdue: a user's method that does not return, named before a run has begun.

An endless loop in a `derivative` looks like a slow start. A thread checks the stack of
the thread that started it, now and then; the checked code pays nothing.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread, get_ident
from types import FrameType

from rems_net.agents.agent import Agent
from rems_net.events import warn
from rems_net.uncaught import is_users

#: s. A method that takes longer before the first tick is reported: most need 1 ms.
REPORT_AFTER = 5.0
#: Number of checks in that time.
LOOKS = 10


@contextmanager
def naming_overdue(over: Callable[[], bool] | None = None) -> Iterator[None]:
    """Warn, once for each, of methods that do not return while the block runs.

    over: called between two checks; if it returns True, the watch ends before its block
    does.
    """
    done = Event()
    looking = (get_ident(), sys._getframe(2), done, over or done.is_set)
    thread = Thread(target=_look, args=looking, name="overdue", daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def _look(
    thread: int, caller: FrameType, done: Event, over: Callable[[], bool]
) -> None:
    """Compare the running method with that of the last check, until `done`."""
    seen: FrameType | None = None
    looks = 0
    while not done.wait(REPORT_AFTER / LOOKS) and not over():
        method = _method(sys._current_frames().get(thread), caller)
        looks = looks + 1 if method is seen else 0
        seen = method
        if seen is not None and looks == LOOKS:
            _report(seen, caller)


def _method(frame: FrameType | None, caller: FrameType) -> FrameType | None:
    """Return the outermost frame of the user's code that `caller` led to."""
    found = None
    while frame is not None and frame is not caller:
        found = frame if _is_users(frame) else found
        frame = frame.f_back
    return found if frame is caller else None


def _is_users(frame: FrameType) -> bool:
    """Return whether the code is the user's; typed at a prompt it is in no file."""
    file = frame.f_code.co_filename
    return is_users(file) or (file[:1] == "<" and not file.startswith("<frozen"))


def _report(method: FrameType, caller: FrameType) -> None:
    name = method.f_code.co_qualname.rpartition("<locals>.")[2]
    place = f"{Path(method.f_code.co_filename).name}, line {method.f_lineno}"
    what = f"{place}," if name == "<module>" else f"{name} ({place})"
    agent = agent_of(method, caller)
    key = "" if agent is None else agent.key
    warn(
        "overdue",
        f"{key}{': ' if key else ''}{what} has not returned for {REPORT_AFTER:g} s. Is "
        "there a loop without end in it? Ctrl+C ends the run.",
        key,
    )


def agent_of(frame: FrameType | None, last: FrameType | None = None) -> Agent | None:
    """Return the agent whose method runs in this frame, or in one that led to it."""
    while frame is not None and frame is not last:
        for name in frame.f_code.co_varnames[:1]:
            own = frame.f_locals.get(name)
            if isinstance(own, Agent) and "name" in vars(own):
                return own
        frame = frame.f_back
    return None

"""Events of a run, as values, and as records of Python's `logging`.

Their logger is `rems_net`; each of its records has the event itself as `record.event`.
"""

import json
import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import astuple, dataclass

#: beginning of an event in a host process's output (ASCII: record separator)
MARK = "\x1e"
LOGGER = logging.getLogger("rems_net")
LEVELS = {"info": logging.INFO, "warning": logging.WARNING, "error": logging.ERROR}


@dataclass(frozen=True)
class Event:
    """One event.

    level: "info", "warning" or "error".  tick: the newest one; 0 before the first.
    agent: the agent that it is about (`robot/sim`), or "clock" or "run".
    kind: one word, the same in all versions.  text: for people, and may change.
    """

    level: str
    tick: int
    agent: str
    kind: str
    text: str

    def __str__(self) -> str:
        """Return the line for people."""
        return f"warning: {self.text}" if self.level == "warning" else self.text

    def to_line(self) -> str:
        """Return the line that a host process prints for it."""
        return f"{MARK}{json.dumps(astuple(self))}\n"

    def log(self) -> None:
        """Log the event with `logging`."""
        LOGGER.log(LEVELS[self.level], "%s", self.text, extra={"event": self})


def read_line(line: str, host: str) -> Iterator[Event]:
    """Yield the events in a line of a host process: a reported one, or a print."""
    printed, mark, told = line.partition(MARK)
    event = _read(told, host) if mark else None
    if event is None or printed:
        text = line if event is None else printed
        yield Event("info", 0, host, "printed", text)
    if event is not None:
        yield event


def _read(told: str, host: str) -> Event | None:
    """Return the event; None if an agent itself has printed the mark."""
    try:
        level, tick, agent, *words = json.loads(told)
    except (TypeError, ValueError):
        return None
    texts = [one for one in (level, agent, *words) if isinstance(one, str)]
    good = type(tick) is int and len(texts) == len(words) + 2 == 4 and level in LEVELS
    return Event(level, tick, agent or host, *words) if good else None


def info(kind: str, text: str, agent: str = "", tick: int = 0) -> None:
    """Report an ordinary event."""
    _report(Event("info", tick, agent, kind, text))


def warn(kind: str, text: str, agent: str = "", tick: int = 0) -> None:
    """Report an unwanted event that does not end the run."""
    _report(Event("warning", tick, agent, kind, text))


@contextmanager
def listening(
    listener: Callable[[Event], None], *, own: bool = False
) -> Iterator[None]:
    """Call `listener` with each event of this process, in the thread that reports it.

    Only the newest listener gets events. Without any, warnings are printed on stderr.
    own: it gets those of this thread alone, which no other listener gets.
    """
    if own:
        before = _own.set(listener)
        try:
            yield
        finally:
            _own.reset(before)
        return
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def _report(event: Event) -> None:
    (_own.get() or _listeners[-1])(event)
    event.log()


def _print(event: Event) -> None:
    if event.level != "info":
        print(event, file=sys.stderr, flush=True)


_own: ContextVar[Callable[[Event], None] | None] = ContextVar("listener", default=None)
_listeners: list[Callable[[Event], None]] = [_print]
# otherwise Python prints warnings a second time
LOGGER.addHandler(logging.NullHandler())

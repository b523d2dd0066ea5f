"""Events: what happens in a run, as values; Python's `logging` has them, too.

Their logger is `rems_net`; each of its records has the event itself as `record.event`.
"""

import json
import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import astuple, dataclass

#: begins an event among the lines that a host process prints (ASCII: record separator)
MARK = "\x1e"
LOGGER = logging.getLogger("rems_net")
LEVELS = {"info": logging.INFO, "warning": logging.WARNING, "error": logging.ERROR}


@dataclass(frozen=True)
class Event:
    """One thing that happened.

    level: "info", "warning" or "error".  tick: the newest one; 0 before the first.
    agent: the agent that it is about (`robot/sim`), or "clock" or "run".
    kind: one word, which stays when the text gets better.  text: for people.
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
        """Return the line by which a host process reports it."""
        return f"{MARK}{json.dumps(astuple(self))}\n"

    def log(self) -> None:
        """Hand it to `logging`."""
        LOGGER.log(LEVELS[self.level], "%s", self.text, extra={"event": self})


def read_line(line: str, host: str) -> Iterator[Event]:
    """Yield what a line of a host process is: an event, or what its agents print."""
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
    """Report what may happen."""
    _report(Event("info", tick, agent, kind, text))


def warn(kind: str, text: str, agent: str = "", tick: int = 0) -> None:
    """Report what should not happen."""
    _report(Event("warning", tick, agent, kind, text))


@contextmanager
def listening(listener: Callable[[Event], None]) -> Iterator[None]:
    """Call `listener` with each event of this process, in the thread that reports it.

    The listener that was added last gets them alone. Without any, warnings are printed
    on stderr.
    """
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def _report(event: Event) -> None:
    _listeners[-1](event)
    event.log()


def _print(event: Event) -> None:
    if event.level != "info":
        print(event, file=sys.stderr, flush=True)


_listeners: list[Callable[[Event], None]] = [_print]
LOGGER.addHandler(logging.NullHandler())  # or Python prints warnings once more

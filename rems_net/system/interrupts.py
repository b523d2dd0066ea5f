"""Interrupts and ends: a Ctrl+C is never lost, and a program that is over ends."""

import logging
import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Protocol
from weakref import WeakSet

#: s. An interrupt is repeated after this time: the code that swallowed it is done by
#: then.
SOON = 0.05
#: end of the name of a thread in which Zenoh calls back; Python waits for each of them
CALLER = "(pyo3-closure)"
CLOSER = "closing"
#: flags of a new process that Ctrl+C and a closed window of Windows do not reach
APART = 0
if sys.platform == "win32":
    import _winapi

    APART = _winapi.CREATE_NEW_PROCESS_GROUP | _winapi.CREATE_NO_WINDOW


@contextmanager
def without_ctrl_c() -> Iterator[None]:
    """Make Ctrl+C do nothing in a process that is started in this block.

    In this process it is delayed until the end of the block. Windows has APART for
    this.
    """
    held: list[tuple[int, FrameType | None]] = []
    # With only a mask, the system would give the signal to another thread, and a
    # half-started process would be left behind.
    handler = signal.getsignal(signal.SIGINT)
    main = threading.current_thread() is threading.main_thread() and callable(handler)
    if main:
        signal.signal(signal.SIGINT, lambda *given: held.append(given))
    masks = hasattr(signal, "pthread_sigmask")
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT]) if masks else ()
    try:
        yield
    finally:
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if main:
            signal.signal(signal.SIGINT, handler)
        if held and callable(handler):
            handler(*held[0])


def ending(status: int) -> str:
    """Return how a process ended, such as `was killed by signal 9`.

    status: as Python returns it; Windows' own errors are above 16 bits.
    """
    if status < 0:
        return f"was killed by signal {-status}"
    shown = f"{status:#x}" if status > 0xFFFF else f"{status}"
    return f"exited with status {shown}"


class Again(logging.Filter):
    """Filter that repeats an interrupt which a library has logged.

    If a session sends a message to itself, Zenoh calls back in the sending thread. If
    that is the main thread, Python may raise a KeyboardInterrupt there, at any line;
    Zenoh logs it as an error of the callback, and continues.
    """

    def filter(self, record: logging.LogRecord) -> bool:
        """Let all other records be logged."""
        if not (record.exc_info and isinstance(record.exc_info[1], KeyboardInterrupt)):
            return True
        again = threading.Timer(SOON, _interrupt)
        again.daemon = True
        again.start()
        return False


def _interrupt() -> None:
    if hasattr(signal, "pthread_kill"):  # also wakes the main thread from a wait
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        interrupt_main()


class Closing:
    """Closes what is still open when the program has nothing left to do.

    Python ends a program after its last thread, and Zenoh's threads that call back end
    with their session only. So a program that has not closed its session would never
    end.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._open: WeakSet[Closes] = WeakSet()
        self._waiting = False

    def add(self, one: "Closes") -> None:
        """Close it at the end of the program, if it still exists."""
        with self._lock:
            self._open.add(one)
            if not self._waiting:
                self._waiting = True
                # Python waits for it: a thread that it cut off here would abort Zenoh.
                threading.Thread(target=self._wait, name=CLOSER, daemon=False).start()

    def _wait(self) -> None:
        threading.main_thread().join()
        while others := [t for t in threading.enumerate() if _works(t)]:
            others[0].join()
        for one in list(self._open):
            one.close()


class Closes(Protocol):
    """Something that is open until it is closed."""

    def close(self) -> None:
        """Close it; a second call does nothing."""


def _works(thread: threading.Thread) -> bool:
    """Return whether a thread keeps the program alive for a reason."""
    ends = thread is threading.main_thread() or thread.name.endswith((CALLER, CLOSER))
    return not thread.daemon and not ends


CLOSING = Closing()

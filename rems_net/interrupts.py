"""Interrupts: a Ctrl+C is delayed where it would do harm, and never lost."""

import logging
import signal
import threading
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

#: s. An interrupt is repeated after this time: the code that swallowed it is done by
#: then.
SOON = 0.05


@contextmanager
def without_ctrl_c() -> Iterator[None]:
    """Make Ctrl+C do nothing in a process that is started in this block.

    In this process it is delayed until the end of the block. Windows has process groups
    for this.
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

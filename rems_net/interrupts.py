"""Interrupts: a Ctrl+C is held back where it would do harm, and never lost."""

import logging
import signal
import threading
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

#: seconds after which an interrupt comes again: whoever swallowed it is done by then
SOON = 0.05


@contextmanager
def without_ctrl_c() -> Iterator[None]:
    """Start a process to which Ctrl+C does nothing, from its very first moment.

    Held back here meanwhile, and not lost. Windows has process groups for this.
    """
    held: list[tuple[int, FrameType | None]] = []
    # A mask holds it back from one thread, and the system gives it to another: half
    # started, a process would be left behind.
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
    """Of a library that calls back: an interrupt that it logs comes once more.

    What a session tells itself, Zenoh calls back in the thread that tells it. In the
    main one Python may raise a KeyboardInterrupt there, at any line; Zenoh logs it as
    an error of the callback, and goes on.
    """

    def filter(self, record: logging.LogRecord) -> bool:
        """Let all else be logged."""
        if not (record.exc_info and isinstance(record.exc_info[1], KeyboardInterrupt)):
            return True
        again = threading.Timer(SOON, _interrupt)
        again.daemon = True
        again.start()
        return False


def _interrupt() -> None:
    if hasattr(signal, "pthread_kill"):  # wakes it from a wait, too
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        interrupt_main()

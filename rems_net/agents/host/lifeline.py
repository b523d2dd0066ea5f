"""Lifeline: a host's standard input. It brings the plans, and its end ends the host.

The module imports next to nothing: from its first moment a host must notice that its
parent is gone, and the agents' imports take a second on a busy machine.
"""

import atexit
import gc
import io
import os
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from queue import SimpleQueue

from rems_net.system.standard_input import read

#: Exit status of a host whose parent is gone or whose agent failed.
FAILED = 1
#: s. Exit functions may take this long.
LEAVING = 1.0


def deaf_to_ctrl_c() -> None:
    """Ignore Ctrl+C and a terminal that hangs up: the parent handles them.

    The parent holds Ctrl+C back while it starts this process, if the system can. An
    agent that reads or sets the terminal gets an error, and is not stopped for it.
    """
    # Windows has only the first
    for name in ("SIGINT", "SIGHUP", "SIGTTIN", "SIGTTOU"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])


class Lifeline:
    """Reader of the standard input, in a thread of its own.

    Until `on_end` sets a function, the end of the input ends this process at once. So
    does a SIGTERM, which a laptop sends to every process when it is shut down.
    """

    #: whether a SIGTERM came
    terminated = False

    def __init__(self) -> None:
        self._words: SimpleQueue[bytes | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._gone: Callable[[], None] | None = None
        self._grace = 0.0
        self._ended = False
        signal.signal(signal.SIGTERM, self._terminate)
        threading.Thread(target=self._read, daemon=True).start()

    def words(self) -> bytes:
        """Return the parent's message: four bytes of length, then that many bytes."""
        said = self._words.get()
        if said is None:
            sys.exit(
                "A host is started by `rems run`, not by hand. Type: rems run FILE"
                " (R0522)"
            )
        return said

    def on_end(self, gone: Callable[[], None], seconds: float) -> None:
        """Call `gone` when the parent is gone, and exit `seconds` later in any case."""
        with self._lock:
            self._gone, self._grace = gone, seconds
            ended = self._ended
        if ended:
            self._end()

    def _read(self) -> None:
        length = int.from_bytes(_exactly(4) or b"", "little")
        said = _exactly(length) if length else None
        self._words.put(said)
        if said is None:  # started by hand: `words` reports it
            return
        while read(4096):
            pass
        with self._lock:
            self._ended = True
        self._end()

    def _terminate(self, *_: object) -> None:
        # a second SIGTERM ends it at once
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        Lifeline.terminated = True
        self._end()

    def _end(self) -> None:
        if self._gone is None:
            _exit(FAILED)  # nothing is open yet
            return
        timer = threading.Timer(self._grace, _exit, args=(FAILED,))
        timer.daemon = True
        timer.start()
        self._gone()


def _exactly(count: int) -> bytes | None:
    """Return this many bytes; None if the input ends before."""
    data = b""
    while len(data) < count:
        more = read(count - len(data))
        if not more:
            return None
        data += more
    return data


def end(status: int) -> None:
    """Exit as a Python program does: flush files, and run the `atexit` functions.

    All agents are closed. Jobs that still run are not waited for, nor are exit
    functions that take longer than `LEAVING` seconds.
    """
    files = open_files()
    flush(files)  # in case something below fails
    sys.unraisablehook = _tell
    timer = threading.Timer(LEAVING, _leave, args=(status,))
    timer.daemon = True
    timer.start()
    atexit._run_exitfuncs()
    timer.cancel()
    flush(files)
    for file in files:
        if type(file).__module__ not in ("_io", "io"):
            with suppress(Exception):
                file.close()  # packed files (gzip and the like) get their end
    flush(files)
    _exit(status)


def _exit(status: int) -> None:
    """Exit at once; by SIGTERM if one came, so that the parent learns the cause."""
    if Lifeline.terminated:
        signal.raise_signal(signal.SIGTERM)
    os._exit(status)


def open_files() -> list[io.IOBase]:
    """Return all open files that have a buffer: text first, then bytes.

    In this order the text gets into the bytes before they are written.
    """
    gc.unfreeze()  # frozen objects are not found
    # The root class of all files; asking io.IOBase itself takes ten times as long.
    root: type = io.IOBase.__mro__[1]
    found = [o for o in gc.get_objects() if issubclass(type(o), root)]
    text = [f for f in found if isinstance(f, io.TextIOBase)]
    rest = [f for f in found if not isinstance(f, io.TextIOBase | io.RawIOBase)]
    return [*text, *rest]


def flush(files: list[io.IOBase]) -> None:
    """Write the contents of their buffers."""
    for file in files:
        with suppress(Exception):  # it is closed, or its reader is gone
            file.flush()


def _leave(status: int) -> None:
    _warn(f"what it does at exit took longer than {LEAVING:g} s")
    _exit(status)


def _tell(failed: "sys.UnraisableHookArgs") -> None:
    """Report what an exit function raised, and where, in one line."""
    from rems_net.agents.diagnosis import describe

    _warn(f"at exit: {describe(failed.exc_value or failed.exc_type())}")


def _warn(text: str) -> None:
    from rems_net.events import Event

    with suppress(OSError):
        os.write(2, Event("warning", 0, "", "exit", text).to_line().encode())

"""Lifeline: a host's standard input. It says what to run; its end ends the host.

Imports next to nothing: from its first moment a host must see that its parent is gone,
and importing what agents need takes it a second on a busy machine.
"""

from __future__ import annotations

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

#: the exit status of a host whose parent is gone or whose agent failed
FAILED = 1
#: seconds that exit functions may take
LEAVING = 1.0


def deaf_to_ctrl_c() -> None:
    """Leave Ctrl+C to the parent, and a terminal that hangs up: its end is told.

    The parent holds Ctrl+C back while it starts this one, where the system can. An
    agent that reads or sets the terminal gets an error; it is not stopped for it.
    """
    for name in ("SIGINT", "SIGHUP", "SIGTTIN", "SIGTTOU"):  # Windows has the first
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])


class Lifeline:
    """Reads the standard input in a thread of its own, from now on.

    Until `on_end` is told otherwise, its end is this process's end, at once. So is a
    SIGTERM, as a laptop that is shut down sends it to every process.
    """

    #: whether there was one
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
        """What the parent says first: four bytes of length, then so many bytes."""
        said = self._words.get()
        if said is None:
            sys.exit("A host is started by `rems run`, not by hand.")
        return said

    def on_end(self, gone: Callable[[], None], seconds: float) -> None:
        """When the parent is gone, call `gone`, and exit `seconds` later anyway."""
        with self._lock:
            self._gone, self._grace = gone, seconds
            ended = self._ended
        if ended:
            self._end()

    def _read(self) -> None:
        length = int.from_bytes(_exactly(4) or b"", "little")
        said = _exactly(length) if length else None
        self._words.put(said)
        if said is None:  # started by hand: it has a sentence to say
            return
        while os.read(0, 4096):
            pass
        with self._lock:
            self._ended = True
        self._end()

    def _terminate(self, *_: object) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a second one ends it at once
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
    """So many bytes; None where the input ends before."""
    data = b""
    while len(data) < count:
        # Not sys.stdin: its buffer would swallow what comes after.
        more = os.read(0, count - len(data))
        if not more:
            return None
        data += more
    return data


def end(status: int) -> None:
    """Exit as a Python program does: files flushed, and what `atexit` was told done.

    All agents are closed; a job that still runs is not waited for, and neither are exit
    functions that take longer than `LEAVING` seconds.
    """
    files = open_files()
    flush(files)  # whatever comes of the rest
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
                file.close()  # what is packed, gzip and its like, gets its end
    flush(files)
    _exit(status)


def _exit(status: int) -> None:
    """Exit at once; by SIGTERM, where one has ended it: its parent tells which."""
    if Lifeline.terminated:
        signal.raise_signal(signal.SIGTERM)
    os._exit(status)


def open_files() -> list[io.IOBase]:
    """All files that nobody has closed and that have a buffer: text first, then bytes.

    So that what is in the one gets into the other.
    """
    gc.unfreeze()  # what is frozen is not found
    # The root of all files; asking io.IOBase itself takes ten times as long.
    root: type = io.IOBase.__mro__[1]
    found = [o for o in gc.get_objects() if issubclass(type(o), root)]
    text = [f for f in found if isinstance(f, io.TextIOBase)]
    rest = [f for f in found if not isinstance(f, io.TextIOBase | io.RawIOBase)]
    return [*text, *rest]


def flush(files: list[io.IOBase]) -> None:
    """Write what is in their buffers."""
    for file in files:
        with suppress(Exception):  # closed, or whoever read it is gone
            file.flush()


def _leave(status: int) -> None:
    _warn(f"what it does at exit took longer than {LEAVING:g} s")
    _exit(status)


def _tell(failed: sys.UnraisableHookArgs) -> None:
    """Report what an exit function raised, and where, in one line."""
    from rems_net.agents.diagnosis import describe

    _warn(f"at exit: {describe(failed.exc_value or failed.exc_type())}")


def _warn(text: str) -> None:
    from rems_net.events import Event

    with suppress(OSError):
        os.write(2, Event("warning", 0, "", "exit", text).to_line().encode())

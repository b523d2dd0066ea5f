"""Worker: a process that does an agent's jobs one by one, and ends with its agent."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import connection, get_context, parent_process
from typing import Any

from rems_net.agents import registry
from rems_net.agents.diagnosis import place


class Worker:
    """One process beside this one. Starting it takes some tenths of a second."""

    def __init__(self) -> None:
        context = get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs,))
        self._process.start()
        theirs.close()
        # What the user's own files define is found there by the same names as here.
        self._pipe.send(registry.loaded_files())

    @property
    def alive(self) -> bool:
        return self._process.is_alive()

    def run(self, function: Callable[..., Any], args: tuple[Any, ...]) -> Any:
        """Return function(*args), done there; raises what it raises.

        Raises RuntimeError where the process itself dies.
        """
        self._pipe.send((function, args))
        try:
            result, error = self._pipe.recv()
        except (EOFError, OSError):
            self._process.join()
            code = self._process.exitcode or 0
            how = f"was killed by signal {-code}" if code < 0 else f"exited ({code})"
            name = getattr(function, "__name__", "?")
            raise RuntimeError(f"the process of job {name} {how}") from None
        if error is not None:
            raise error
        return result

    def kill(self) -> None:
        """End it now, whatever it does."""
        self._process.kill()


def serve(pipe: connection.Connection) -> None:
    """What a worker runs: the jobs that come through the pipe, until it closes."""
    # Ctrl+C reaches every process of a terminal; the agent's end is this one's end.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(EOFError):
        for path in pipe.recv():
            registry.load_file(path)
        while True:
            _serve_one(pipe)


def _serve_one(pipe: connection.Connection) -> None:
    result: Any = None
    failure: BaseException | None = None
    try:
        function, args = pipe.recv()
        result = function(*args)
    except EOFError:
        raise
    except BaseException as error:
        failure = error
        failure.add_note(place(error))
    try:
        pipe.send((result, failure))
    except Exception as error:  # it cannot travel: what it says can
        problem = failure or error
        plain = RuntimeError(f"{type(problem).__name__}: {problem}")
        pipe.send((None, plain))


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        sys.stdout.flush()
        os._exit(1)

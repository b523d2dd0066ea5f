"""Worker: a process that does an agent's jobs one by one, and ends with its agent."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from multiprocessing import connection, get_context, parent_process
from pathlib import Path
from queue import Empty, SimpleQueue
from types import ModuleType
from typing import Any

from rems_net.agents import registry
from rems_net.agents.diagnosis import place
from rems_net.system.interrupts import ending, without_ctrl_c

#: The name of a script's module in the processes of multiprocessing.
SCRIPT = "__mp_main__"
#: held while a process is started: the script of this process is hidden then
_MAIN = threading.Lock()


class Worker:
    """One process beside this one. Starting it takes some tenths of a second.

    environment: its variables; without any, those of this process.
    """

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        context = get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs,))
        with without_ctrl_c(), _script_hidden() as script, _having(environment):
            self._process.start()
        theirs.close()
        # The user's own files are loaded there under the same names as here.
        self._pipe.send((script, registry.loaded_files()))

    @property
    def alive(self) -> bool:
        return self._process.is_alive()

    def run(self, function: Callable[..., Any], args: tuple[Any, ...]) -> Any:
        """Return function(*args), computed there; raise what it raises.

        Raises RuntimeError if the process itself dies.
        """
        try:
            with _MAIN:
                self._pipe.send((function, args))
            result, error = self._pipe.recv()
        except (EOFError, OSError):
            self._process.join()
            how = ending(self._process.exitcode or 0)
            name = getattr(function, "__name__", "?")
            raise RuntimeError(f"the process of job {name} {how}") from None
        if error is not None:
            raise error
        return result

    def kill(self) -> None:
        """End it now, even during a job."""
        self._process.kill()

    def join(self) -> None:
        """Wait for its end."""
        self._process.join()


class Workers:
    """Workers that take turns: a function waits for none that is idle.

    environment: of each; without any, that of this process.
    """

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        self._environment = environment
        self._idle: SimpleQueue[Worker] = SimpleQueue()
        self._all: list[Worker] = []

    def run(self, function: Callable[..., Any], args: tuple[Any, ...]) -> Any:
        """Return function(*args) of an idle worker, or of a new one.

        It raises what the function raises, and RuntimeError if the process dies.
        """
        try:
            worker = self._idle.get_nowait()
        except Empty:
            worker = Worker(self._environment)
            self._all.append(worker)
        try:
            return worker.run(function, args)
        finally:
            if worker.alive:
                self._idle.put(worker)

    def kill(self) -> None:
        """End all of them now, even during a job."""
        for worker in self._all:
            worker.kill()
        for worker in self._all:
            worker.join()


@contextmanager
def _having(environment: Mapping[str, str] | None) -> Iterator[None]:
    """Let a process that is started in this block have these variables."""
    if environment is None:
        yield
        return
    before = dict(os.environ)  # which multiprocessing hands on
    try:
        os.environ.clear()
        os.environ.update(environment)
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


@contextmanager
def _script_hidden() -> Iterator[Path | None]:
    """Hide this process's script from a starting process; yield its path.

    The new process would run the experiment again. It imports the script up to there.
    """
    with _MAIN:  # held first: another thread may have hidden it
        main = sys.modules["__main__"]
        path = getattr(main, "__file__", None)
        if path is None or main.__spec__ is not None:
            yield None
            return
        sys.modules["__main__"] = ModuleType("__main__")
        # results of the script's classes come back by this name
        sys.modules[SCRIPT] = main
        try:
            yield Path(path).absolute()
        finally:
            sys.modules["__main__"] = main


def serve(pipe: connection.Connection) -> None:
    """Run the jobs that come through the pipe, until it closes."""
    # Ctrl+C reaches every process of a terminal; this process ends with its agent.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    registry.enter_run()
    with suppress(EOFError):
        script, files = pipe.recv()
        for path in files:
            registry.load_file(path)
        if script is not None:
            sys.modules["__main__"] = registry.load_file(script, SCRIPT)
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
    except Exception as error:  # the error cannot be pickled, but its text can
        problem = failure or error
        plain = RuntimeError(f"{type(problem).__name__}: {problem}")
        pipe.send((None, plain))


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        sys.stdout.flush()
        os._exit(1)

"""Pool: an executor of processes on this machine, which compute as hosts do."""

import os
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any

from rems_net.agents.background.worker import Workers
from rems_net.maths.numerics import environment


def cores() -> int:
    """Return how many cores this process may use."""
    allowed = getattr(os, "sched_getaffinity", None)  # not on Windows and macOS
    return len(allowed(0)) if allowed else os.cpu_count() or 1


class Pool(Executor):
    """Executor of pinned processes: the last digits are those of `rems run`.

    count: processes.  If one dies, only its call fails, and the next gets a new one.
    """

    def __init__(self, count: int):
        self.count = count
        self._workers = Workers(environment(os.environ))
        self._threads = ThreadPoolExecutor(count, "sweep")

    def submit(
        self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any
    ) -> Future[Any]:
        """Call a function with these arguments in an idle process."""
        assert not kwargs
        return self._threads.submit(self._workers.run, fn, args)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End all processes; those that still work are killed."""
        self._threads.shutdown(wait=wait and not cancel_futures, cancel_futures=True)
        self._workers.kill()

"""Jobs: work that takes longer than a tick, done beside the ticks.

    def step(self, tick):
        if tick.n == 1:
            self.jobs.submit(plan_path, self.map, then=self.follow)

`follow(path)` is called in a later step of the same agent: its code stays in one
thread. A job never delays a tick.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from queue import Empty, SimpleQueue
from typing import Any

from rems_net.errors import SchemaError

Then = Callable[[Any], None]

#: jobs of one agent at a time; more wait their turn
WORKERS = 2


class Jobs:
    """One agent's jobs. Threads by default; `process=True` for what needs a core."""

    def __init__(self) -> None:
        self._pools: dict[bool, Executor] = {}
        self._done: SimpleQueue[tuple[Future[Any], Then | None, Then | None]] = (
            SimpleQueue()
        )

    def submit(
        self,
        function: Callable[..., Any],
        *args: Any,
        then: Then | None = None,
        failed: Then | None = None,
        process: bool = False,
    ) -> None:
        """Start `function(*args)`, and call `then(result)` in a later step.

        failed(exception) is called if it raises; without it the exception is raised
        in the agent's next step. process=True runs it in a process of its own, where
        function and arguments must be importable and plain.
        """
        if not callable(function):
            raise SchemaError(
                f"jobs.submit takes a function and its arguments, not {function!r}; "
                "write submit(f, x), not submit(f(x))."
            )
        if process not in self._pools:
            self._pools[process] = (
                ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn"))
                if process
                else ThreadPoolExecutor(WORKERS, thread_name_prefix="job")
            )
        future = self._pools[process].submit(function, *args)
        future.add_done_callback(lambda done: self._done.put((done, then, failed)))

    def deliver(self) -> None:
        """Call back for every job that has ended; the host does so before a step."""
        while self._pools:
            try:
                done, then, failed = self._done.get_nowait()
            except Empty:
                return
            if done.cancelled():
                continue
            error = done.exception()
            if error is None:
                if then is not None:
                    then(done.result())
            elif failed is not None:
                failed(error)
            else:
                raise error

    def close(self) -> None:
        """Cancel what has not begun. What runs is left to the end of the process."""
        for pool in self._pools.values():
            pool.shutdown(wait=False, cancel_futures=True)
        self._pools.clear()

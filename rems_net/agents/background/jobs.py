"""Jobs: work that takes longer than a tick, done beside the ticks.

    def step(self, tick):
        if tick.n == 1:
            self.jobs.submit(plan_path, self.map, then=self.follow)

`follow(path)` is called in a later step of the same agent: its code stays in one
thread. A job never delays a tick.
"""

from __future__ import annotations

from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from rems_net.errors import SchemaError

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

    from rems_net.agents.background.worker import Workers

Then = Callable[[Any], None]

#: Number of jobs of one agent at a time; more wait their turn.
WORKERS = 2


class Jobs:
    """One agent's jobs: in threads, or in processes for jobs that need a core."""

    def __init__(self) -> None:
        #: whether a job was ever submitted
        self.any = False
        self._pools: dict[bool, ThreadPoolExecutor] = {}
        self._workers: Workers | None = None
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

        failed(exception) is called if it raises; without it the exception is raised in
        the agent's next step. process=True runs it in another process, for work that
        needs a core. Its function is defined at the top of a file; the function, the
        arguments and the result are pickled.
        """
        if not callable(function):
            raise SchemaError(
                f"jobs.submit takes a function and its arguments, not {function!r}; "
                "write submit(f, x), not submit(f(x)). (R0510)"
            )
        from concurrent.futures import ThreadPoolExecutor  # takes 6 ms to load

        self.any = True
        if process not in self._pools:
            self._pools[process] = ThreadPoolExecutor(WORKERS, "job")
        if process:
            name = getattr(function, "__qualname__", "")
            if "<" in name:
                raise SchemaError(
                    f"{name} is defined inside a function, where another process "
                    "cannot find it; define it at the top of the file. (R0427)"
                )
            if self._workers is None:
                from rems_net.agents.background.worker import Workers

                self._workers = Workers()
            future = self._pools[True].submit(self._workers.run, function, args)
        else:
            future = self._pools[False].submit(function, *args)
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
        """Cancel jobs that have not begun, and end those in other processes.

        A thread cannot be ended: it ends with the process of its agent.
        """
        for pool in self._pools.values():
            pool.shutdown(wait=False, cancel_futures=True)
        self._pools.clear()
        if self._workers is not None:
            self._workers.kill()

"""Jobs: work that takes longer than a tick, done beside the ticks.

    def step(self, tick):
        if tick.n == 1:
            self.jobs.submit(plan_path, self.map, then=self.follow)

`follow(path)` is called in a later step of the same agent: its code stays in one
thread. A job never delays a tick, unless it has a step in which its result is due.
"""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from types import ModuleType
from typing import TYPE_CHECKING, Any

from rems_net.errors import SchemaError
from rems_net.events import warn

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

    from rems_net.agents.background.worker import Workers

Then = Callable[[Any], None]

#: Number of jobs of one agent at a time; more wait their turn.
WORKERS = 2
#: s. A job that holds a tick for so long is reported, and again after ten times that.
PATIENCE = 1.0


@dataclass
class Due:
    """A job whose result is given in one step, neither earlier nor later.

    left: steps until then      name: of its function
    """

    future: "Future[Any]"
    then: Then | None
    failed: Then | None
    left: int
    name: str


class Jobs:
    """One agent's jobs: in threads, or in processes for jobs that need a core."""

    def __init__(self, key: str) -> None:
        #: key of the agent
        self.key = key
        #: whether a job was ever submitted
        self.any = False
        self._due: list[Due] = []
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
        due: int = 0,
    ) -> None:
        """Start `function(*args)`, and call `then(result)` in a later step.

        due=20 calls it 20 steps from now, neither earlier nor later, so that a run
        gives the same bytes every time. A run in lock-step waits for a late result; an
        agent that is free-running does not, and gets it late. The function gets copies
        of the arguments.

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
        if due:
            _check_due(function, due)
            args = deepcopy(args)
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
        if due:
            called = getattr(function, "__name__", type(function).__name__)
            self._due.append(Due(future, then, failed, due, called))
            return
        future.add_done_callback(lambda done: self._done.put((done, then, failed)))

    def deliver(self, n: int, *, in_step: bool) -> None:
        """Call back for every job that has ended; the engine does so before a step.

        n: the tick.  in_step: whether to wait for a job that is due now.
        """
        for job in self._due:
            job.left -= 1
        for job in [job for job in self._due if job.left <= 0]:
            if in_step and not job.future.done():
                self._wait(job, n)
            if job.future.done():
                self._due.remove(job)
                if job.left < 0:
                    self._report_late(job)
                _call_back(job.future, job.then, job.failed)
        while self._pools:
            try:
                done = self._done.get_nowait()
            except Empty:
                return
            _call_back(*done)

    def _wait(self, job: Due, n: int) -> None:
        """Hold the tick until a job has ended, and report it."""
        from concurrent.futures import wait

        # `diagnosis.where` finds this text, for the clock's own report of a held tick.
        waits_for = f"waiting for job {job.name}, whose result is due at this step"
        patience, waited = PATIENCE, 0.0
        while wait([job.future], patience - waited).not_done:
            waited, patience = patience, 10 * patience
            text = f"tick {n} is held by {self.key} for {waited:g} s, {waits_for}"
            warn("late", text, self.key, n)

    def _report_late(self, job: Due) -> None:
        warn(
            "late",
            f"{self.key}: the result of job {job.name} came {-job.left} steps late; a "
            "free-running agent waits for no job, so this run cannot be repeated "
            "exactly",
            self.key,
        )

    def close(self) -> None:
        """Cancel jobs that have not begun, and end those in other processes.

        A thread cannot be ended: it ends with the process of its agent.
        """
        for pool in self._pools.values():
            pool.shutdown(wait=False, cancel_futures=True)
        self._pools.clear()
        self._due.clear()
        if self._workers is not None:
            self._workers.kill()


def _check_due(function: Callable[..., Any], due: object) -> None:
    """Raise SchemaError if a result cannot be due then, or not the same every time."""
    if type(due) is not int or due < 1:
        raise SchemaError(
            f"a job is due={due!r}; expected the number of steps until its result is "
            "given, such as due=20. (R0870)"
        )
    owner = getattr(function, "__self__", None)
    if owner is not None and not isinstance(owner, type | ModuleType):
        raise SchemaError(
            f"a job with due=... is {function.__qualname__}, a method of an object, "
            "which can change before the job reads it; write a function that takes "
            "what it needs, which is copied: submit(train, self.weights, due=20). "
            "(R0870)"
        )


def _call_back(done: "Future[Any]", then: Then | None, failed: Then | None) -> None:
    if done.cancelled():
        return
    error = done.exception()
    if error is None:
        if then is not None:
            then(done.result())
    elif failed is not None:
        failed(error)
    else:
        raise error

"""An input that submits jobs, and notes what comes of them."""

from __future__ import annotations

import os
import threading

from rems_net import Input, Out, Settings, Tick
from rems_net.agents.runtime import runtime
from rems_net.defdict import boolean, text
from tests.agents.parts import COUNT
from tests.signals import KILL


class Noting(Input):
    """Submits a job and notes what comes of it."""

    options = Settings(what=text(default="square"), process=boolean(default=False))
    value = Out(COUNT)

    def open(self) -> None:
        self.at = 0
        self.thread = threading.get_ident()

    def read(self, tick: Tick) -> dict[str, object]:
        if tick.n == 3:
            process = bool(self.options.process)
            match self.options.what:
                case "square":
                    self.jobs.submit(square, 12, then=self.note, process=process)
                case "long":
                    self.jobs.submit(pause, 2.0, then=self.note, process=process)
                case "endless":
                    self.jobs.submit(pause, 1000.0, then=self.note, process=process)
                case "busy":
                    for _ in range(4):
                        self.jobs.submit(pause, 1000.0, process=process)
                case "fails":
                    self.jobs.submit(fail, 3, failed=self.failed, process=process)
                case "raises":
                    self.jobs.submit(fail, 3, process=process)
                case "dies":
                    self.jobs.submit(die, failed=self.failed, process=process)
                case "lambda":
                    self.jobs.submit(lambda: 3, then=self.note, process=process)
                case "called":
                    self.jobs.submit(square(3), then=self.note, process=process)  # type: ignore[arg-type]
        return {"n": tick.n, "at": self.at, "dt": tick.dt}

    def note(self, result: object) -> None:
        same = threading.get_ident() == self.thread
        print(f"job gave {result}, in the agent's thread: {same}", flush=True)
        self.at = runtime(self).tick.n

    def failed(self, error: Exception) -> None:
        print(f"job failed: {type(error).__name__}: {error}", flush=True)
        self.at = runtime(self).tick.n


def square(x: int) -> int:
    return x * x


def pause(seconds: float) -> str:
    threading.Event().wait(seconds)
    return "rested"


def fail(x: int) -> None:
    raise LookupError(f"{x} is not there")


def die() -> None:
    os.kill(os.getpid(), KILL)

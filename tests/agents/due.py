"""A process whose jobs are due in a step, for runs that must give the same bytes."""

import threading
from typing import Any

import numpy as np

from rems_net import In, Out, Process, Schema, Settings, Tick, Woodbot
from rems_net.units import boolean, integer, number, time

VALUE = Schema("learned", {"value": number(), "n": number()})


class Learner(Process):
    """Sums what it reads, in a job at every step; nobody obeys its value."""

    options = Settings(
        due=integer(default=3),
        process=boolean(default=False),
        rest=time(default=0.0),
    )
    pose = In(Woodbot.state)
    learned = Out(VALUE)
    #: ticks at which results came, and the ticks of which they are
    came: list[tuple[int, int]]

    def open(self) -> None:
        self.sum, self.came, self.read = np.zeros(4), [], np.zeros(4)

    def step(self, tick: Tick) -> None:
        self.read += tick.n, self.pose.x, self.pose.y, self.pose.heading
        what = self.options
        self.jobs.submit(
            train,
            self.read,
            tick.n,
            what.rest,
            then=self.take,
            due=what.due,
            process=bool(what.process),
        )
        self.learned = {"value": float(self.sum.sum()), "n": tick.n}

    def take(self, result: Any) -> None:
        read, n = result
        self.sum += read
        self.came.append((self.tick.n, n))


class Free(Learner):
    """As the robot of a device: no tick waits for it."""

    lockstep = False


def train(read: Any, n: int, rest: float) -> tuple[Any, int]:
    threading.Event().wait(rest)
    return read / 7.0, n


class Wrong(Learner):
    """Submits what cannot be due."""

    def step(self, tick: Tick) -> None:
        if self.options.due == 0:
            self.jobs.submit(train, self.read, 1, 0.0, due=-1)
        else:
            self.jobs.submit(self.take, (self.read, 1), due=2)


class Failing(Learner):
    """Its job raises an error."""

    def step(self, tick: Tick) -> None:
        if tick.n == 2:
            self.jobs.submit(divide, 0.0, due=self.options.due)


def divide(x: float) -> float:
    return 1.0 / x

"""Bench: steps one robot as its host would, in fabric time or in wall time."""

import time
from collections.abc import Mapping
from typing import Any

from rems_net.agents.robot import Robot
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick, time_of
from rems_net.testing.values import Numbers, apart, numbers

#: seconds of a step: of a robot that is simulated, and of one that is driven
FABRIC, WALL = 0.05, 0.02

Values = Mapping[str, Any]


class Bench:
    """In fabric time: as fast as it goes.

    dt: seconds of a step.  n: steps made.
    """

    def __init__(self, robot: Robot, dt: float = FABRIC):
        self.robot, self.dt = robot, dt
        self.n = 0

    def count(self, seconds: float) -> int:
        """How many steps that is."""
        return max(1, round(seconds / self.dt))

    def step(self, values: Values | None = None) -> None:
        """Make a step, at which it is told these values, all of its command, or nothing
        new.
        """
        self.n += 1
        robot, n, run = self.robot, self.n, runtime(self.robot)
        if values is not None:
            robot.__dict__["command"] = robot.schemas()["command"](values)
            run.take("command", n, self.dt)
        robot.step(run.begin(Tick(n, time_of(n, self.dt), self.dt, self.pace)))
        run.end()

    #: of its ticks
    pace = 0.0

    def run(self, values: Values, seconds: float) -> list[dict[str, Any]]:
        """Tell it so at every step; where it was after each, by path."""
        path = []
        for _ in range(self.count(seconds)):
            self.step(values)
            path.append(self.where())
        return path

    def cease(self, seconds: float) -> None:
        """Tell it nothing any more for so long."""
        for _ in range(self.count(seconds)):
            self.step()

    def go(self, values: Values | None, seconds: float) -> Mapping[str, float]:
        """How far it goes in so many seconds, by path; told this, or nothing."""
        before = self.numbers()
        if values is None:
            self.cease(seconds)
        else:
            self.run(values, seconds)
        return apart(before, self.numbers())

    def where(self) -> dict[str, Any]:
        """Its state now, by path."""
        return dict(self.robot.__dict__["state"].copy().flat())

    def numbers(self) -> Numbers:
        """The numbers of its state now."""
        return numbers(self.robot.__dict__["state"])


class WallBench(Bench):
    """In wall time: a step each 20 ms. When commands cease, so do the ticks."""

    pace = 1.0

    def __init__(self, robot: Robot):
        super().__init__(robot, WALL)
        self._due = time.monotonic()

    def step(self, values: Values | None = None) -> None:
        """Make a step when it is due."""
        self._due = max(self._due + self.dt, time.monotonic() - self.dt)
        time.sleep(max(0.0, self._due - time.monotonic()))
        super().step(values)

    def cease(self, seconds: float) -> None:
        """Make no step for so long, and only look where it is."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.robot.sense()
            time.sleep(self.dt)
        self.robot.sense()


def bench(robot: Robot) -> Bench:
    """The bench for this robot."""
    return Bench(robot) if robot.lockstep else WallBench(robot)

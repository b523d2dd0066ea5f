"""Bench: steps one robot as its host does, in fabric time or in wall time."""

import time
from collections.abc import Mapping
from typing import Any

from rems_net.agents.robot import Robot
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick, time_of
from rems_net.testing.values import Numbers, apart, numbers

#: s. Length of a step: of a simulated robot, and of a driven one.
FABRIC, WALL = 0.05, 0.02

Values = Mapping[str, Any]


class Bench:
    """Stepping in fabric time, as fast as possible.

    dt: length of a step, s.  n: number of steps made.
    """

    def __init__(self, robot: Robot, dt: float = FABRIC):
        self.robot, self.dt = robot, dt
        self.n = 0

    def count(self, seconds: float) -> int:
        """Return how many steps so many seconds are."""
        return max(1, round(seconds / self.dt))

    def step(self, values: Values | None = None) -> None:
        """Make a step with a new command: all its values; or with none."""
        self.n += 1
        robot, n, run = self.robot, self.n, runtime(self.robot)
        if values is not None:
            robot.__dict__["command"] = robot.schemas()["command"](values)
            run.source_ticks["command"] = n
        robot.step(run.begin(Tick(n, time_of(n, self.dt), self.dt, self.pace)))
        run.end()

    #: Pace of its ticks: 0 is as fast as possible, 1 is wall time.
    pace = 0.0

    def run(self, values: Values, seconds: float) -> list[dict[str, Any]]:
        """Command these values at every step; return the state after each, by path."""
        path = []
        for _ in range(self.count(seconds)):
            self.step(values)
            path.append(self.where())
        return path

    def cease(self, seconds: float) -> None:
        """Step for so many seconds without a new command."""
        for _ in range(self.count(seconds)):
            self.step()

    def go(self, values: Values | None, seconds: float) -> Mapping[str, float]:
        """Return how far it goes in so many seconds, by path.

        values: the command; None for no new command.
        """
        before = self.numbers()
        if values is None:
            self.cease(seconds)
        else:
            self.run(values, seconds)
        return apart(before, self.numbers())

    def where(self) -> dict[str, Any]:
        """Return its state now, by path."""
        return dict(self.robot.__dict__["state"].copy().flat())

    def numbers(self) -> Numbers:
        """Return the numbers of its state now."""
        return numbers(self.robot.__dict__["state"])


class WallBench(Bench):
    """Stepping in wall time, every 20 ms. Without commands there are no ticks."""

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
        """Make no step for so many seconds; only read the state."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.robot.sense()
            time.sleep(self.dt)
        self.robot.sense()


def bench(robot: Robot) -> Bench:
    """Return the bench for this robot."""
    return Bench(robot) if robot.lockstep else WallBench(robot)

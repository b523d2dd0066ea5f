"""Agents that crash, in the ways that `how` says, the first `times` that they live."""

import os

from rems_net import Driver, Input, Out, Settings, Tick
from rems_net.agents.agent import Agent
from rems_net.defdict import DefDict, integer, text
from rems_net.outputs.csv import CsvOutput
from tests.agents.parts import COMMAND
from tests.signals import KILL


class Crashing(Agent):
    options = Settings(
        how=text(default="kill"), at=integer(default=5), times=integer(default=1)
    )

    def open(self) -> None:
        super().open()
        if self.options.how == "open" and 0 < self.restarts < self.options.times:
            raise OSError("the stick is not plugged in")

    def step(self, tick: Tick) -> None:
        if tick.n % self.options.at or self.restarts >= self.options.times:
            super().step(tick)
            return
        if self.options.how == "kill":
            os.kill(os.getpid(), KILL)
        if self.options.how == "exit":
            os._exit(7)
        raise ZeroDivisionError("no more")


class Stick(Crashing, Input):
    value = Out(COMMAND)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"speed": 0.5, "turn": 0.1 * self.restarts}


class Wheel(Crashing, Driver):
    def drive(self, command: DefDict, dt: float) -> None:
        self.state.x += dt * command.speed

    def sense(self) -> None:
        pass


class Free(Wheel):
    lockstep = False


class Writes(Crashing, CsvOutput):
    pass

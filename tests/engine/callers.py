"""Agents that call verbs, and robots whose verbs are called."""

from __future__ import annotations

from typing import Any

from rems_net import Definition, In, Out, Process, Schema, Settings, Tick, Verbs, verb
from rems_net.defdict import DefDict, integer, length, number, text, velocity
from rems_net.drivers.kinematic.kinematic import Kinematic

COMMAND = Schema("sled.command", {"speed": velocity(range=(-1, 1), default=0.5)})
STATE = Schema("sled.state", {"x": length()})


class Sled(Definition):
    """Goes on by itself; can be put somewhere, and counts how often it was."""

    command = In(COMMAND)
    state = Out(STATE)
    sensors = Out(Schema("sled.sensors", {"moved": integer(), "by": text()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"x": command["speed"]}

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"moved": self.moved, "by": self.by}

    def rewind(self) -> None:
        self.moved, self.by = 0, ""
        super().rewind()

    @verb
    def put(self, x: float, *, by: str = "") -> float:
        if x < 0:
            raise ValueError("there is no floor")
        self.state = {"x": x}
        self.moved += 1
        self.by += by
        return x


class Free(Kinematic):
    """Never waited for, as what is really driven."""

    lockstep = False


class Geared(Definition):
    """Goes as fast as its gear says."""

    command = In(COMMAND)
    state = Out(STATE)
    gear = 1.0

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"x": self.gear * command["speed"]}

    @verb
    def shift(self, gear: float) -> None:
        self.gear = gear


class Referee(Process):
    """Puts a sled back when it is too far."""

    options = Settings(most=number(default=0.3))
    sled = In(STATE)
    verbs = Verbs(sled)
    value = Out(COMMAND)

    def step(self, tick: Tick) -> None:
        self.value = {"speed": 0.9}
        if self.sled.x > self.options.most:
            self.verbs.put(0.01 * tick.n, by=self.name[0])


class Crowd(Process):
    """Calls a verb of each of many, and two of one."""

    sleds = In()
    verbs = Verbs(sleds)

    def step(self, tick: Tick) -> None:
        for key, sled in self.sleds.items():
            if sled.x > 0.4:
                self.verbs[key].reset()
                self.verbs[key].put(x=0.1)


class Wrong(Process):
    """Calls what the setting says, at one tick."""

    options = Settings(what=text(), at=number(default=3))
    sled = In(STATE)
    verbs = Verbs(sled)

    def step(self, tick: Tick) -> None:
        if tick.n == self.options.at:
            exec(f"self.verbs{self.options.what}", {"self": self, "DefDict": DefDict})


class Names(Process):
    """Names a verb, and calls nothing."""

    sled = In(STATE)
    verbs = Verbs(sled)

    def step(self, tick: Tick) -> None:
        if self.sled.x > 0.3:
            self.verbs["robot/a"].reset  # noqa: B018 - the mistake


class Far(Process):
    """Passes a sled's way on, times a factor."""

    factor = 2
    sled = In(STATE)
    value = Out(Schema("far", {"way": length()}))

    def step(self, tick: Tick) -> None:
        self.value = {"way": self.factor * self.sled.x}


class Farther(Far):
    """Has a greater factor."""

    factor = 1000

"""Agents with settings that change while they run."""

from typing import Any

from rems_net import Definition, In, Input, Out, Schema, Settings, Tick, sin
from rems_net.defdict import DefDict, length, number, text, velocity

SPEED = Schema("tuned.speed", {"speed": velocity()})


class Swing(Input):
    """A speed that swings, by a gain that may change."""

    options = Settings(
        gain=number(default=0.5, range=(0, 2), doc="of the swing"),
        rest=velocity(default=0.1, range=(-1, 1)),
        title=text(default="swing"),
    )
    adjustable = ("gain", "rest")
    value = Out(SPEED)

    def read(self, tick: Tick) -> dict[str, Any]:
        return {"speed": self.options.rest + self.options.gain * sin(tick.t)}


class Cart(Definition):
    """Goes as commanded, times a factor of its own that may change."""

    parameters = Settings(factor=number(default=1.0, range=(0, 1)))
    adjustable = ("factor",)
    command = In(SPEED)
    state = Out(Schema("tuned.state", {"x": length()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"x": self.parameters.factor * command["speed"]}

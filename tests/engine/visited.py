"""Agents whose verbs a program outside calls."""

from typing import Any

from rems_net import Definition, In, Input, Out, Process, Schema, Tick, verb
from rems_net.defdict import DefDict, length, number, velocity

SPEED = Schema("visited.speed", {"speed": velocity(default=0.5)})
STATE = Schema("visited.state", {"x": length()})


class Cart(Definition):
    """Goes on, with a factor of its own that a verb changes."""

    command = In(SPEED)
    state = Out(STATE)
    sensors = Out(Schema("visited.sensors", {"load": number()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"x": command["speed"]}

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"load": self.load + self.random.random()}

    def rewind(self) -> None:
        self.load = 0.0
        super().rewind()

    @verb
    def put(self, x: float, *, load: float = 0.0) -> float:
        """Put it somewhere, with another load; refuse what is behind."""
        self.load += load
        if x < 0:
            raise ValueError("there is no floor")
        self.state = {"x": x}
        return x

    @verb
    def take(self, thing: object) -> None:
        """Take what is no plain data."""
        self.load = float(len(str(type(thing))))


class Echo(Input):
    """Reads a cart, as of the tick before, and tells its place as a speed."""

    cart = In(STATE)
    value = Out(SPEED)

    def read(self, tick: Tick) -> dict[str, Any]:
        return {"speed": 0.25 + 0.125 * self.cart.x}


class Mute(Process):
    """Says a speed that depends on a cart."""

    cart = In(STATE)
    value = Out(SPEED)
    more = 1.0

    def step(self, tick: Tick) -> None:
        self.value = {"speed": self.more - self.cart.x}


class Pilot(Mute):
    """The same, and a verb changes it between two ticks."""

    @verb
    def shout(self, speed: float) -> None:
        """Say another speed at once, and more from then on."""
        self.more += 0.5
        self.value = {"speed": speed}

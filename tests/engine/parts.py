"""Agents of which the generated experiments are made."""

from typing import Any

from rems_net import (
    Definition,
    In,
    Input,
    Out,
    Process,
    Schema,
    Settings,
    Tick,
)
from rems_net.defdict import (
    DefDict,
    angle,
    angular_velocity,
    length,
    number,
    percent,
    velocity,
)
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.maths import cos, sin

COMMAND = Schema(
    "cart.command",
    {
        "speed": velocity("m/s", range=(-1, 1)),
        "turn": angular_velocity("rad/s", range=(-2, 2)),
    },
)
#: the same in other units, and in percent
SLOW = Schema("slow", {"speed": velocity("mm/s"), "turn": angular_velocity("deg/s")})
STICK = Schema("stick", {"speed": percent(), "turn": percent()})
STATE = Schema("cart.state", {"x": length(), "y": length(), "heading": angle()})


class Cart(Definition):
    command = In(COMMAND)
    state = Out(STATE)

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        v, heading = command["speed"], state["heading"]
        return {"x": v * cos(heading), "y": v * sin(heading), "heading": command.turn}


class Jumper(Kinematic):
    """Goes back to where it began, again and again, by its own verb."""

    def drive(self, command: DefDict, dt: float) -> None:
        super().drive(command, dt)
        if self.tick.n % 7 == 0:
            self.reset()


class Wave(Input):
    """Says something at every tick, or only now and then."""

    options = Settings(rate=number(default=1.0), pause=number(default=0.0))
    value = Out(COMMAND)

    def read(self, tick: Tick) -> dict[str, float] | None:
        if self.options.pause and sin(tick.t * self.options.pause) < 0:
            return None
        return {"speed": 0.5 * sin(self.options.rate * tick.t), "turn": cos(tick.t)}


class Slow(Input):
    """In millimetres and degrees."""

    value = Out(SLOW)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"speed": 200.0 + tick.n % 7, "turn": self.random.uniform(-30, 30)}


class Stick(Input):
    """In percent of what the robot can do."""

    value = Out(STICK)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"speed": 30.0 * cos(tick.t), "turn": float(tick.n % 5)}


class Follow(Process):
    """Steers a cart by where another one is, and by what it said itself before."""

    one = In(STATE)
    other = In(STATE)
    value = Out(COMMAND)

    def step(self, tick: Tick) -> None:
        gap = self.one.x - self.other.x
        self.value = {"speed": max(-1.0, min(1.0, gap)), "turn": sin(self.one.heading)}


class Middle(Process):
    """Reads whatever matches."""

    carts = In()
    value = Out(COMMAND)

    def step(self, tick: Tick) -> None:
        if self.carts:
            mean = sum(state.x for state in self.carts.values()) / len(self.carts)
            self.value = {"speed": max(-1.0, min(1.0, 0.1 - mean)), "turn": 0.1}


class Wheels(Input):
    """Commands a Woodbot to go straight on, then to turn, and to come back."""

    value = Out(
        Schema("wheels", {"wheel": {s: angular_velocity() for s in ("left", "right")}})
    )

    def read(self, tick: Tick) -> dict[str, float]:
        return {"wheel/left": 5.0, "wheel/right": 5.0 if tick.t < 1.5 else -2.0}

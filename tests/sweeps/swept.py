"""Agents of the experiments that the tests sweep, in a file as a user has them."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from rems_net import (
    Definition,
    In,
    Input,
    Out,
    Process,
    Schema,
    Settings,
    Tick,
    cos,
    sin,
)
from rems_net.units import angle, angular_velocity, length, number, text, velocity


class Cart(Definition):
    command = In(Schema("command", {"speed": velocity(), "turn": angular_velocity()}))
    state = Out(Schema("state", {"x": length(), "y": length(), "heading": angle()}))

    def derivative(self, state, command):  # type: ignore[no-untyped-def]
        v, turn, heading = command["speed"], command["turn"], state["heading"]
        return {"x": v * cos(heading), "y": v * sin(heading), "heading": turn}


class Weave(Input):
    """Draws its turns."""

    value = Out(Cart.command)
    options = Settings(speed=velocity(default=0.2), wild=number(default=0.5))

    def read(self, tick: Tick) -> dict[str, float]:
        turn = self.options["wild"] * self.random.uniform(-1, 1)
        return {"speed": self.options["speed"], "turn": turn}


class Calm(Weave):
    """Turns only by the time."""

    def read(self, tick: Tick) -> dict[str, float]:
        return {"speed": self.options["speed"], "turn": cos(tick.t)}


class Trouble(Process):
    """Fails, or kills its process as long as its file is there."""

    options = Settings(at=number(default=-1.0), deadly=text(default=""))
    seen = In(Cart.state, source="robot/sim/state")

    def step(self, tick: Tick) -> None:
        file = Path(self.options["deadly"])
        if self.options["deadly"] and file.exists():
            left = int(file.read_text()) - 1
            file.write_text(f"{left}") if left else file.unlink()
            os.kill(os.getpid(), signal.SIGTERM)
        if tick.n == self.options["at"]:
            raise ValueError("too much of it")

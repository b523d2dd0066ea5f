"""Agents that do next to nothing, so that what is measured is the fabric."""

from __future__ import annotations

from typing import ClassVar

from rems_net import Definition, Driver, In, Input, Out, Schema
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict, angle, angular_velocity, length, velocity

STATE = Schema(
    "bench.state",
    {
        "x": length("m"),
        "y": length("m"),
        "heading": angle("rad"),
        "speed": velocity("m/s"),
    },
)
COMMAND = Schema("bench.command", {"speed": velocity("m/s", range=(-1, 1))})


class Dot(Definition):
    """A robot of four numbers."""

    command = In(COMMAND)
    state = Out(STATE)


class Count(Driver):
    """Writes a new state at every tick and does nothing else."""

    def drive(self, command: DefDict, dt: float) -> None:
        self.state.x += dt

    def sense(self) -> None:
        pass


class Circle(Input):
    """Two wheels that go round at different speeds, for ever."""

    SPEEDS: ClassVar[dict[str, float]] = {"wheel/left": 2.0, "wheel/right": 3.0}

    value = Out(
        Schema(
            "bench.wheels",
            {"wheel": {side: angular_velocity() for side in ("left", "right")}},
        )
    )

    def read(self, tick: Tick) -> dict[str, float]:
        return self.SPEEDS

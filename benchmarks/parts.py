"""Agents that do next to nothing, so that what is measured is the fabric."""

from __future__ import annotations

from rems_net import Definition, Driver, In, Out, Schema
from rems_net.defdict import DefDict, angle, angular_velocity, length, velocity
from rems_net.robots.woodbot import Woodbot

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


class Circling(Woodbot):
    """A Woodbot that drives in a circle, told nothing."""

    command = In(
        Schema(
            "bench.wheels",
            {
                "wheel": {
                    "left": angular_velocity(default=2.0),
                    "right": angular_velocity(default=3.0),
                }
            },
        )
    )

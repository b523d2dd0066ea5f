"""A robot that is elsewhere: its pose by the tick, from an input."""

from math import pi
from typing import Any

from rems_net import In, Input, Out, Process, Schema, Settings, Tick, Woodbot
from rems_net.units import angle, angular_velocity, length, number
from tests.drivers.worlds.test_shared import Tall

__all__ = ["Drive", "Near", "Tall", "Walk"]

POSE = Schema("pose", {"x": length(), "y": length(), "heading": angle()})


class Walk(Input):
    """Says nothing at first; then it comes along the x axis, and may fall silent."""

    options = Settings(
        start=length(default=0.3),
        goes=number("m/s"),
        first=number(default=3),
        silent=number(default=1e9),
        again=number(default=1e9),
    )
    value = Out(POSE)

    def read(self, tick: Tick) -> dict[str, Any] | None:
        o, n = self.options, tick.n
        if n < o.first or o.silent <= n < o.again:
            return None
        way = o.goes * (n - o.first) * tick.dt
        return {"x": o.start + way, "y": 0.0, "heading": 3 * pi}


class Drive(Input):
    """Both wheels at one speed."""

    options = Settings(speed=angular_velocity())
    value = Out(Woodbot.command)

    def read(self, tick: Tick) -> dict[str, Any]:
        return {"wheel/left": self.options.speed, "wheel/right": self.options.speed}


class Near(Process):
    """Stands if its lidar, or that of its ghost, meets something."""

    seen = In()
    value = Out(Woodbot.command)

    def step(self, tick: Tick) -> None:
        speed = 3.0 if self.seen["lidar/front"] > 0.1 else 0.0
        self.value = {"wheel/left": speed, "wheel/right": speed}

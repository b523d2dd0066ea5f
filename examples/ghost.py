"""Ten simulated Woodbots and a real one, emulated here, drive behind each other.

The real one stands among the simulated ones as a ghost: they see it, and stop at it.
"""

from dataclasses import replace
from math import pi, remainder, tau
from typing import Any

from rems_net import (
    Experiment,
    In,
    Input,
    Out,
    Process,
    Schema,
    Tick,
    Woodbot,
    atan2,
    cos,
    hypot,
    sin,
)
from rems_net.bodies import Body, Cylinder, Part
from rems_net.drivers import emulated
from rems_net.units import percent

WHEELS = Schema("wheels", {"wheel": {"left": percent(), "right": percent()}})
RING, REAL, COUNT = 0.8, 5, 11  # m; which one is real; how many


class Masted(Woodbot):
    def body(self) -> Body:  # with a mast, which the lidars of others meet
        mast = Part(Cylinder(0.02, 0.03), 1e-3, at=(0.0, 0.0, 0.01))
        woodbot = super().body()
        return replace(woodbot, parts=(*woodbot.parts, mast))


class Circle(Input):
    value = Out(WHEELS)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"wheel/left": 55.8, "wheel/right": 64.2}


class Follow(Process):
    ahead = In()  # the robot in front, or its ghost
    me = In(Woodbot.state)
    seen = In()
    value = Out(WHEELS)

    def step(self, tick: Tick) -> None:
        ahead = self.ahead.get("pose", self.ahead)
        dx, dy = ahead["x"] - self.me["x"], ahead["y"] - self.me["y"]
        turn = 60 * remainder(atan2(dy, dx) - self.me["heading"], tau)
        speed = 300 * hypot(dx, dy)  # the farther, the faster
        if self.seen["lidar/front"] < 0.06:  # something is in the way
            speed = turn = 0
        self.value.clip({"wheel/left": speed - turn, "wheel/right": speed + turn})


if __name__ == "__main__":  # not in the agents' processes, which read it, too
    lab = Experiment("ghost", dt="50 ms", duration="8 s", pace=1)
    real = {"name": "real", "definition": Masted, "follows": "robot/real/state"}
    lab.world("ring", options={"size": [2.4, 2.4]}, ghosts=[real])
    lab.input("circle", Circle)
    names = ["real" if i == REAL else f"w{i}" for i in range(COUNT)]
    with emulated("woodbot-ws") as device:
        for i, name in enumerate(names):
            a = -0.25 * i
            at = {"x": RING * cos(a), "y": RING * sin(a), "heading": a + pi / 2}
            more: dict[str, Any] = {
                "command": f"process/{name}" if i else "input/circle",
                "initial": at,
            }
            if i == REAL:
                url = {"url": device.where}
                lab.robot(name, Masted, "woodbot-ws", options=url, **more)
            else:
                lab.robot(name, Masted, "kinematic", world="ring", **more)
            if i:
                front, own = names[i - 1], name
                lab.process(
                    name,
                    Follow,
                    ahead="world/ring/real"
                    if front == "real"
                    else f"robot/{front}/state",
                    me=f"robot/{own}/state",
                    seen="world/ring/real_sensors"
                    if i == REAL
                    else f"robot/{own}/sensors",
                    host="minds",
                )
        lab.output("log", "csv")
        lab.run()

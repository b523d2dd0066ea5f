"""Ten simulated Woodbots and an emulated one, which is a ghost there, in a row."""

from dataclasses import replace
from math import atan2, cos, hypot, pi, remainder, sin, tau
from typing import Any

from rems_net import Experiment, In, Out, Process, Schema, Tick, Woodbot
from rems_net.bodies import Body, Cylinder, Part
from rems_net.drivers import emulated
from rems_net.units import percent

WHEELS = Schema("wheels", {"wheel": {"left": percent(), "right": percent()}})


class Masted(Woodbot):
    def body(self) -> Body:  # the lidars of others meet its mast
        mast = Part(Cylinder(0.02, 0.03), 1e-3, at=(0.0, 0.0, 0.01))
        return replace(super().body(), parts=(*super().body().parts, mast))


class Follow(Process):
    ahead, me, seen, value = In(), In(Woodbot.state), In(), Out(WHEELS)

    def step(self, tick: Tick) -> None:
        ahead = self.ahead.get("pose", self.ahead)
        dx, dy = ahead["x"] - self.me["x"], ahead["y"] - self.me["y"]
        turn = 60 * remainder(atan2(dy, dx) - self.me["heading"], tau)
        speed = 300 * hypot(dx, dy)
        speed, turn = (speed, turn) if speed else (60, 4.2)  # the leader: a circle
        speed *= self.seen["lidar/front"] > 0.06  # nothing is in the way
        self.value.clip({"wheel/left": speed - turn, "wheel/right": speed + turn})


if __name__ == "__main__":  # not in the agents' processes, which read it, too
    lab = Experiment("ghost", dt="50 ms", duration="8 s", pace=1)
    real = {"name": "real", "definition": Masted, "follows": "robot/w5/state"}
    lab.world("ring", options={"size": [2.4, 2.4]}, ghosts=[real])
    with emulated("woodbot-ws") as device:
        for i, a in enumerate(-i / 4 for i in range(11)):
            ahead = "world/ring/real" if i == 6 else f"robot/w{max(i, 1) - 1}/state"
            at = {"x": 0.8 * cos(a), "y": 0.8 * sin(a), "heading": a + pi / 2}
            told: dict[str, Any] = {"driver": "kinematic", "world": "ring"}
            seen = "world/ring/real_sensors" if i == 5 else f"robot/w{i}/sensors"
            if i == 5:  # its controller reads the lidar of its ghost
                told = {"driver": "woodbot-ws", "options": {"url": device.where}}
            lab.robot(f"w{i}", Masted, command=f"process/w{i}", initial=at, **told)
            me = f"robot/w{i}/state"
            lab.process(f"w{i}", Follow, ahead=ahead, me=me, seen=seen, host="minds")
        lab.output("log", "csv")
        lab.run()

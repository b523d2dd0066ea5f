"""A follower chases a leader: its process reads both robots, and drives one."""

from math import remainder, tau

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
    hypot,
)
from rems_net.units import percent

WHEELS = Schema("wheels", {"wheel": {"left": percent(), "right": percent()}})


class Circle(Input):
    value = Out(WHEELS)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"wheel/left": 40.0, "wheel/right": 60.0}


class Follow(Process):
    leader = In(Woodbot.state)
    me = In(Woodbot.state)
    value = Out(WHEELS)

    def step(self, tick: Tick) -> None:
        dx, dy = self.leader["x"] - self.me["x"], self.leader["y"] - self.me["y"]
        turn = 60 * remainder(atan2(dy, dx) - self.me["heading"], tau)
        ahead = 250 * hypot(dx, dy)  # the farther, the faster
        self.value.clip({"wheel/left": ahead - turn, "wheel/right": ahead + turn})


lab = Experiment("follow", dt="50 ms", duration="25 s")
lab.input("circle", Circle)
lab.process("follow", Follow, leader="robot/leader/state", me="robot/follower/state")
start = {"x": "28 cm", "heading": "90 deg"}
lab.robot("leader", "woodbot", "kinematic", command="input/circle", initial=start)
lab.robot("follower", "woodbot", "kinematic", command="process/follow")
lab.output("log", "csv")
lab.run()

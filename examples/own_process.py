"""A process reads and writes: this one turns a Woodbot until it heads north."""

from math import pi

from rems_net import Experiment, In, Out, Process, Schema, Tick, Woodbot
from rems_net.units import percent


class North(Process):
    state = In(Woodbot.state)
    value = Out(Schema("north", {"wheel": {"left": percent(), "right": percent()}}))

    def step(self, tick: Tick) -> None:
        turn = 200 * (pi / 2 - self.state["heading"])
        self.value.clip({"wheel/left": -turn, "wheel/right": turn})


lab = Experiment("north", dt="20 ms", duration="3 s")
lab.process("pilot", North, state="robot/sim/state")
lab.robot("sim", "woodbot", "kinematic", command="process/pilot")
lab.output("log", "csv")
lab.run()

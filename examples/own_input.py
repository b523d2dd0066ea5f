"""An input writes one method, `read`: the values that hold over this tick."""

from rems_net import Experiment, Input, Out, Schema, Tick, sin
from rems_net.units import percent


class Weave(Input):
    value = Out(Schema("weave", {"wheel": {"left": percent(), "right": percent()}}))

    def read(self, tick: Tick) -> dict[str, float]:
        return {"wheel/left": 60 + 40 * sin(tick.t), "wheel/right": 60}


lab = Experiment("weave", duration="10 s")
lab.input("hand", Weave)
lab.robot("sim", "woodbot", "kinematic", command="input/hand")
lab.output("log", "csv")
lab.run()

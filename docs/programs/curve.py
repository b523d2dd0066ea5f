from math import sin

from rems_net import Experiment, Input, Out, Schema, read
from rems_net.units import percent


class Curve(Input):
    value = Out(Schema("wheels", {"wheel": {"left": percent(), "right": percent()}}))

    def read(self, tick):
        return {"wheel": {"left": 50, "right": 50 + 30 * sin(tick.t)}}


lab = Experiment("curve", dt="50 ms", duration="5 s")
lab.input("curve", Curve)
lab.robot("sim", "woodbot", "kinematic", command="input/curve")
result = lab.run()

print(result["sim"]["state/x"][-1])
print(result["input/curve"])
print(read("runs/curve/run.mcap")["sim"]["time"][:3])

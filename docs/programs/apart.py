from rems_net import Experiment, Input, Out, Schema, sin
from rems_net.units import percent


class Weave(Input):
    value = Out(Schema("wheels", {"wheel": {"left": percent(), "right": percent()}}))

    def read(self, tick):
        return {"wheel": {"left": 40 + 20 * sin(tick.t), "right": 40}}


lab = Experiment("apart", dt="20 ms", duration="6 s")
lab.input("hand", Weave)
for name, change in {
    "kinematic": {},
    "aside": {"initial": {"y": "5 cm"}},
    "wide": {"parameters": {"track": "124 mm"}},
    "large": {"parameters": {"track": "124 mm", "wheel_radius": "21 mm"}},
}.items():
    lab.robot(name, "woodbot", "kinematic", command="input/hand", **change)
lab.output("log", "csv")
result = lab.run()

x = result["wide"]["state/x"]
print(x[-1], x.max().to("cm"), x.units)
print(result.table("wide"))
found = result.why("kinematic", "wide")
print([(cause.kind, cause.numbers, cause.share) for cause in found.causes])
print(found.partings[0].where.time, found.line)
print(result.plot())

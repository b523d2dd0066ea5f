from rems_net import Experiment, Input, Out, Schema, Settings
from rems_net.units import percent


class Keys(Input):
    options = Settings(speed=percent(default=20, range=(0, 100)))
    adjustable = ("speed",)
    value = Out(Schema("keys", {"wheel/left": percent(), "wheel/right": percent()}))

    def read(self, tick):
        return {"wheel/left": self.options.speed, "wheel/right": self.options.speed}


lab = Experiment("lab", duration="2 s")
lab.input("keys", Keys)
lab.robot("sim", "woodbot", "kinematic", command="input/keys")
with lab.engine() as engine:
    engine.step(10)
    engine["keys"].adjust(speed=40)
    engine.step(10)

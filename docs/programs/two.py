from rems_net import Experiment, Input, Out, Woodbot


class Curve(Input):
    value = Out(Woodbot.command)

    def read(self, tick):
        return {"wheel/left": 3.0, "wheel/right": 4.0}


for day, heading in (("monday", 0.0), ("tuesday", 0.5)):
    lab = Experiment("lab", dt="20 ms", duration="10 s")
    lab.input("curve", Curve)
    start = {"heading": heading}
    lab.robot("sim", "woodbot", "kinematic", command="input/curve", initial=start)
    lab.run(f"runs/{day}", direct=True)

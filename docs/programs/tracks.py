from rems_net import Experiment, Input, Out, Woodbot, sweep


class Curve(Input):
    value = Out(Woodbot.command)

    def read(self, tick):
        return {"wheel/left": 3.0, "wheel/right": 4.0}


lab = Experiment("tracks", dt="100 ms", duration="2 s")
lab.input("curve", Curve)
lab.robot("sim", "woodbot", "kinematic", command="input/curve")
swept = sweep(lab, {"robot/sim.track": "90..130 mm/3"}, seeds=2, measure="x - 1 mm")
print(swept.table)  # arrays by heading, for pandas; swept.frame() is a DataFrame
print(swept.failed)  # number of each run that failed, with its sentence
print(swept[1]["sim"]["state/heading"][-1])  # the recording of a run

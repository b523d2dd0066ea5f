from rems_net import Experiment, In, Input, Out, Output, Schema, Settings, Woodbot
from rems_net.units import percent, text


class Steady(Input):
    options = Settings(speed=percent(default=20))
    value = Out(Schema("steady", {"wheel": {"left": percent(), "right": percent()}}))

    def read(self, tick):
        speed = self.options["speed"]
        return {"wheel": {"left": speed, "right": speed}}


class Notes(Output):
    options = Settings(title=text(default="notes"))
    robot = In(Woodbot.state)

    def open(self):
        self.file = (self.out / "notes.txt").open("w")
        print(self.options["title"], file=self.file)

    def write(self, tick):
        print(f"{tick.t:.1f} s: {self.robot['x']:.3f} m", file=self.file)

    def close(self):
        self.file.close()


for speed in (10, 50):
    lab = Experiment(f"speed_{speed}", duration="1 s")
    lab.input("driver", Steady, options={"speed": speed})
    lab.robot("sim", "woodbot", "kinematic", command="input/driver")
    lab.output("notes", Notes, robot="robot/sim/state", options={"title": f"{speed} %"})
    lab.run()

"""An arm draws a circle over the floor: for every tick, the joints for a next point."""

from math import pi

from rems_net import Experiment, Input, Out, Tick, YoubotArm, cos, sin


class Circle(Input):
    value = Out(YoubotArm.command)

    def prepare(self) -> None:
        super().prepare()
        self.arm = YoubotArm("arm")  # its mathematics; nothing that moves
        self.arm.prepare()

    def read(self, tick: Tick) -> dict[str, float]:
        point = (0.2 + 0.05 * cos(tick.t), 0.05 * sin(tick.t), 0.05)
        found = self.arm.ik(point, pitch=pi / 2)  # straight down
        self.arm.state = found.joints  # so that the next are near these
        return {**found.joints, "arm/speed": 1.0}


lab = Experiment("reach", dt="50 ms", duration="6.3 s")
lab.input("circle", Circle)
lab.robot("arm", "youbot_arm", "kinematic", command="input/circle")
lab.output("log", "csv")
lab.run()

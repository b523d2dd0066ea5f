from rems_net import Experiment, hypot
from rems_net.gym import Task, make


class Reach(Task):
    def reward(self, now, before):
        return self.away(before) - self.away(now)

    def ends(self, now):
        return self.away(now) < 0.02

    def away(self, moment):
        return hypot(moment["x"] - 0.25, moment["y"])


lab = Experiment("reach", dt="50 ms", duration="10 s")
lab.robot("sim", "woodbot", "kinematic")
env = make(lab, act="robot/sim/command", observe="robot/sim/state", task=Reach)

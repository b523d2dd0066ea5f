from rems_net import Experiment, In, Out, Process, Schema, Woodbot
from rems_net.units import length


class Mean(Process):
    pose = In(Woodbot.state, source="robot/sim/state")
    value = Out(Schema("mean", {"x": length()}))

    def open(self):
        self.seen = []

    def step(self, tick):
        self.seen.append(self.pose.x)
        if tick.n % 10 == 0:
            self.jobs.submit(mean, self.seen, then=self.take, due=20)

    def take(self, result):  # 20 steps later, in this agent's own thread
        self.value = {"x": result}


def mean(values):
    return sum(values) / len(values)


lab = Experiment("means", dt="50 ms", duration="5 s")
lab.robot("sim", "woodbot", "kinematic")
lab.process("mean", Mean)
lab.run(direct=True)

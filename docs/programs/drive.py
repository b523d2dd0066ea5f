import math

from rems_net import Experiment, In, Out, Process, Woodbot


class Drive(Process):
    state = In(Woodbot.state, source="robot/sim/state")
    value = Out(Woodbot.command)

    def step(self, tick):
        turn = math.tanh(2.0 * self.state.heading)  # the policy: it keeps to y = 0
        self.value.update({"wheel/left": 5.0 + turn, "wheel/right": 5.0 - turn})


lab = Experiment("drive", dt="50 ms", duration="2 s")
lab.robot("sim", "woodbot", "kinematic", command="process/policy")
lab.process("policy", Drive)
lab.run()

from rems_net import Experiment, In, Input, Out, Process, Verbs, Woodbot, verb


class Racer(Woodbot):
    @verb
    def start_at(self, y: float) -> None:
        self.state = {"x": 0.0, "y": y}  # m


class Ahead(Input):
    value = Out(Woodbot.command)

    def read(self, tick):
        return {"wheel/left": 5.0, "wheel/right": 5.0}


class Referee(Process):
    racer = In(Woodbot.state)
    verbs = Verbs(racer)

    def step(self, tick):
        if self.racer["x"] > 0.1:  # it is over the line
            self.verbs.start_at(0.1)


lab = Experiment("race", duration="3 s")
lab.input("ahead", Ahead)
lab.robot("racer", Racer, "kinematic", command="input/ahead")
lab.process("referee", Referee, racer="robot/racer/state")
lab.output("log", "csv")
lab.run()

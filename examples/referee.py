"""A process calls verbs of a robot that it reads: here one of the robot's own."""

from pathlib import Path

from rems_net import Experiment, In, Process, Tick, Verbs, Woodbot, verb


class Racer(Woodbot):
    @verb
    def start_at(self, y: float) -> None:
        self.state = {"x": 0.0, "y": y}  # m


class Referee(Process):
    racer = In(Racer.state)
    verbs = Verbs(racer)

    def step(self, tick: Tick) -> None:
        if self.racer["x"] > 0.1:  # it is over the line
            self.verbs.start_at(self.racer["y"] + 0.1)


lab = Experiment("referee", duration="5 s", folder=Path(__file__).parent)
lab.input("keys", "csv", options={"file": "keys.csv"})
lab.robot("racer", Racer, "kinematic", command="input/keys")
lab.process("referee", Referee, racer="robot/racer/state")
lab.output("log", "csv")
lab.run()

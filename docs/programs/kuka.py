from rems_net import (
    Experiment,
    In,
    Input,
    Out,
    Process,
    Youbot,
    YoubotArm,
    YoubotBase,
    sin,
)


class Ahead(Input):
    value = Out(YoubotBase.command)

    def read(self, tick):
        return {"linear/x": 0.2}


class Wave(Process):
    robot = In(Youbot.state)
    value = Out(YoubotArm.command.schema.slice("arm/joint/2", "arm/speed"))

    def step(self, tick):
        self.value = {"arm/joint/2": 0.5 * sin(5 * self.robot["x"]), "arm/speed": 1.0}


lab = Experiment("kuka", duration="3 s")
lab.input("base", Ahead)
lab.process("arm", Wave, robot="robot/kuka/state")
lab.robot("kuka", "youbot", "kinematic", command=["input/base", "process/arm"])
lab.output("log", "csv")
lab.run()

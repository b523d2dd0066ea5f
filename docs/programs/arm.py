from pathlib import Path

from rems_net import Definition, Experiment, In, Out, Schema
from rems_net.bodies import Driven, Model, Servo, Tachometer
from rems_net.units import angle, angular_velocity


class Arm(Definition):
    command = In(Schema("command", {"lift": angle(range=(-1.5, 1.5), default=0.5)}))
    state = Out(Schema("state", {"angle": angle()}))
    sensors = Out(Schema("sensors", {"speed": angular_velocity()}))

    def body(self):
        lift = Driven(
            "lift", droop=0.2, servo=Servo(gain=20, speed=2), position="angle"
        )
        return Model(
            Path(__file__).parent / "arm.urdf",
            joints=(lift,),
            sensors=(Tachometer("speed", "lift"),),
            fixed=True,
        )


lab = Experiment("arm", dt="50 ms", duration="1 s")
lab.robot("arm", Arm, "mujoco")
lab.output("log", "csv")
lab.run()

"""Kalman filters know where a robot is; a model without sensors does not."""

from math import sin

from rems_net import Experiment, Input, Out, Tick, Woodbot
from rems_net.units import percent


class Weave(Input):
    value = Out(Woodbot.command)

    def read(self, tick: Tick) -> dict[str, object]:
        left, right = 55 + 20 * sin(tick.t), 45 - 15 * sin(0.7 * tick.t)
        return {"wheel/left": left * percent, "wheel/right": right * percent}


lab = Experiment("estimate", dt="0.1 s", duration="30 s")
lab.input("keys", Weave)
lab.robot(  # its wheels are farther apart than its definition knows
    "real",
    "woodbot",
    "kinematic",
    command="input/keys",
    parameters={"track": "118 mm"},
    options={"noise": True},
)
lab.robot("model", "woodbot", "kinematic", command="input/keys")
for name in ("ekf", "ukf"):
    lab.process(
        name,
        name,
        command="input/keys",
        sensors="robot/real/sensors",
        options={"definition": "woodbot", "slip": 0.06},
    )
lab.output("log", "csv")
lab.run()

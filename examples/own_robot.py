"""A definition says what a robot is: what it is told, where it is, how it moves."""

from pathlib import Path

from rems_net import DefDict, Definition, Experiment, In, Out, Schema, cos, sin
from rems_net.units import angle, angular_velocity, length, velocity


class Cart(Definition):
    command = In(Schema("command", {"speed": velocity(), "turn": angular_velocity()}))
    state = Out(Schema("state", {"x": length(), "y": length(), "heading": angle()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, float]:
        v, heading, turn = command["speed"], state["heading"], command["turn"]
        return {"x": v * cos(heading), "y": v * sin(heading), "heading": turn}


lab = Experiment("cart", duration="5 s", folder=Path(__file__).parent)
lab.input("keys", "csv", options={"file": "cart.csv"})
lab.robot("cart", Cart, "kinematic", command="input/keys", initial={"x": "-50 cm"})
lab.output("log", "csv")
lab.run()

"""A PID controller brings a cart to 1 m and keeps it there, against a steady wind."""

from rems_net import (
    DefDict,
    Definition,
    Experiment,
    In,
    Out,
    Process,
    Schema,
    Settings,
    Tick,
)
from rems_net.units import force, length, number, velocity


class Cart(Definition):
    command = In(Schema("command", {"push": force(range=(-5, 5))}))
    state = Out(Schema("state", {"x": length(), "speed": velocity()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, float]:
        wind, mass = -0.5, 1.0  # N, kg
        return {"x": state["speed"], "speed": (command["push"] + wind) / mass}


class Pid(Process):
    options = Settings(
        p=number(default=4.0), i=number(default=0.0), d=number(default=3.0)
    )
    state = In(Cart.state)
    value = Out(Cart.command)
    total = 0.0

    def step(self, tick: Tick) -> None:
        gain, error = self.options, 1.0 - self.state["x"]
        self.total += error * tick.dt
        push = gain["p"] * error + gain["i"] * self.total
        self.value.clip({"push": push - gain["d"] * self.state["speed"]})


lab = Experiment("pid", dt="20 ms", duration="20 s")
for name, i in (("pd", 0.0), ("pid", 1.0)):  # without the integral the wind wins
    lab.process(name, Pid, state=f"robot/{name}/state", options={"i": i})
    lab.robot(name, Cart, "kinematic", command=f"process/{name}")
lab.output("log", "csv")
lab.run()

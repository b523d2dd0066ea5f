"""A swarm of twenty: each hears all of them by a glob, and flies as the others do."""

from math import pi, remainder, tau

from rems_net import (
    DefDict,
    Definition,
    Experiment,
    In,
    Out,
    Process,
    Schema,
    Tick,
    atan2,
    cos,
    sin,
)
from rems_net.units import angle, angular_velocity, length


class Bird(Definition):
    command = In(Schema("command", {"turn": angular_velocity(range=(-1, 1))}))
    state = Out(Schema("state", {"x": length(), "y": length(), "heading": angle()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, float]:
        way = state["heading"]
        return {"x": 0.1 * cos(way), "y": 0.1 * sin(way), "heading": command["turn"]}


class Flock(Process):
    me = In(Bird.state)
    birds = In(source="robot/*/state")  # a dict: `robot/b7/state` and its value
    value = Out(Bird.command)

    def step(self, tick: Tick) -> None:
        x = y = 0.0
        for bird in self.birds.values():  # fly where they fly, and stay close to them
            x += cos(bird["heading"]) + bird["x"] - self.me["x"]
            y += sin(bird["heading"]) + bird["y"] - self.me["y"]
        self.value.clip({"turn": remainder(atan2(y, x) - self.me["heading"], tau)})


lab = Experiment("swarm", duration="20 s")
for i in range(20):
    at = {"x": cos(i * pi / 10), "y": sin(i * pi / 10), "heading": 2 * sin(7 * i)}
    lab.process(f"b{i}", Flock, me=f"robot/b{i}/state", host="minds")  # one process
    lab.robot(f"b{i}", Bird, "kinematic", command=f"process/b{i}", initial=at, host="b")
lab.output("log", "csv")
lab.run()

"""A network learns what a model leaves over, and predicts another run with it."""

from pathlib import Path
from typing import Any

from rems_net import Experiment, Input, Out, Schema, Tick
from rems_net.units import percent

OPEN = {"arena_radius": 0}  # a floor without a wall
WORN = {**OPEN, "wheel_torque": "0.01 N*m", "tail_friction": 0.3}


class Keys(Input):
    value = Out(Schema("keys", {"wheel/left": percent(), "wheel/right": percent()}))

    def read(self, tick: Tick) -> dict[str, float] | None:
        if tick.n % 6 != 1:  # each key is held for 0.6 s
            return None
        left, right = self.random.choices((-50, 0, 50, 80, 100), k=2)
        return {"wheel/left": left, "wheel/right": right}


def drive(lab: Experiment) -> Experiment:
    lab.input("keys", Keys)
    lab.robot("real", "woodbot", "mujoco", command="input/keys", parameters=WORN)
    lab.output("log", "csv")
    return lab


if __name__ == "__main__":  # not in the agents' processes, which read it, too
    lab = drive(Experiment("learn", duration=30, seed=1))
    options = {"definition": "woodbot", "parameters": "arena_radius = 0"}
    options["save"] = "weights.json"
    ports: dict[str, Any] = {p: f"robot/real/{p}" for p in ("command", "state")}
    lab.process("learner", "residual", **ports, options=options)
    weights = {"correction": str(Path(lab.run().folder, "weights.json").resolve())}
    lab = drive(Experiment("predict", duration="10 s", seed=2))
    like: dict[str, Any] = {"command": "input/keys", "parameters": OPEN}
    lab.robot("alone", "woodbot", "kinematic", **like)
    lab.robot("corrected", "woodbot", "kinematic", **like, options=weights)
    lab.run()

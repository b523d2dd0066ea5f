"""A run whose last digits tell what it was computed with. `python platforms.py OUT`."""

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from rems_net import Experiment, In, Input, Out, Process, Schema, Tick
from rems_net.defdict import percent
from rems_net.maths import cos, exp, sin
from rems_net.robots.woodbot import Woodbot

WHEELS = Schema("wheels", {"wheel": {"left": percent(), "right": percent()}})
TURN = np.array([[0.8, -0.6], [0.6, 0.8]])


class Wave(Input):
    value = Out(WHEELS)

    def read(self, tick: Tick) -> dict[str, float]:
        left = 70.0 * sin(tick.t) + exp(-tick.t)
        return {"wheel/left": left, "wheel/right": 80.0 * cos(0.7 * tick.t)}


class Numpy(Process):
    """Steers by what numpy, OpenBLAS and the C library make of a state."""

    state = In(Woodbot.state)
    value = Out(WHEELS)

    def step(self, tick: Tick) -> None:
        pose = np.array([self.state["x"], self.state["heading"] + tick.t])
        grown = np.exp(np.sin(np.full(16, pose[1]) * np.arange(16)))
        left, right = 9.0 * TURN @ pose + np.tanh(grown.reshape(8, 2)).sum(axis=0)
        self.value.clip({"wheel/left": float(left), "wheel/right": float(right)})


def lab(native: bool = False) -> Experiment:
    """All in one process of the run's."""
    made = Experiment("platforms", dt="20 ms", duration="4 s", native=native)
    made.input("wave", Wave, host="all")
    for i in range(3):
        made.robot(
            f"k{i}",
            "woodbot",
            "kinematic",
            command="input/wave",
            initial={"heading": 0.1 * i},
            options={"integrator": "rk4"},
            host="all",
        )
    made.process("numpy", Numpy, state="robot/led/state", host="all")
    made.robot("led", "woodbot", "kinematic", command="process/numpy", host="all")
    if find_spec("mujoco"):
        made.robot("mujoco", "woodbot", "mujoco", command="input/wave", host="all")
    made.output("log", "csv", host="all")
    return made


if __name__ == "__main__":
    lab("--native" in sys.argv).run(Path(sys.argv[1]))

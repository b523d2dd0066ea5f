"""A camera: an e-puck looks for the red ball, and drives up to it."""

import numpy as np

from rems_net import EpuckWithCamera, Experiment, In, Out, Process, Schema, Tick
from rems_net.units import percent


class FindBall(Process):
    sensors = In(EpuckWithCamera.sensors)
    value = Out(Schema("chase", {"wheel": {"left": percent(), "right": percent()}}))

    def step(self, tick: Tick) -> None:
        red, green, blue = np.moveaxis(self.sensors["camera"].astype(int), 2, 0)
        ball = (red > 2 * green) & (red > 2 * blue)
        ahead, turn = 0.0, -15.0  # look about, until it is there
        if ball.any():
            to_the_right = np.nonzero(ball)[1].mean() - (ball.shape[1] - 1) / 2
            ahead = 60.0 if ball.mean() < 0.3 else 0.0  # near enough
            turn = -float(to_the_right)
        self.value.clip({"wheel/left": ahead - turn, "wheel/right": ahead + turn})


lab = Experiment("find_ball", dt="0.1 s", duration="8 s")
lab.world(
    "arena",
    options={
        "size": [1.2, 1.0],
        "balls": [{"name": "ball", "radius": "3 cm", "x": 0.4, "y": 0.2}],
        "boxes": [{"name": "crate", "size": [0.06, 0.06, 0.06], "x": -0.3, "y": 0.3}],
    },
)
lab.process("eyes", FindBall, sensors="robot/bot/sensors")
lab.robot(
    "bot",
    "epuck_camera",
    "mujoco",
    world="arena",
    command="process/eyes",
    initial={"heading": "120 deg"},
)
lab.output("log", "csv")
lab.output("album", "pictures", every=10)
lab.run()

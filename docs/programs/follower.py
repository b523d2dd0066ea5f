from math import radians

from rems_net import Epuck, Out
from rems_net.bodies import Camera, sensed

DOWN = Camera(
    "down",
    at=(0.04, 0.0, 0.05),
    direction=(0.0, 0.0, -1.0),
    width=32,
    height=24,
    field_of_view=radians(60),
    every=5,
)


class Follower(Epuck):
    """An e-puck that looks at the floor before it."""

    senses = (*Epuck.senses, DOWN)
    sensors = Out(sensed("follower.sensors", senses, "a guess"))


print(Follower.sensors.schema["down"].shape, DOWN.shape)

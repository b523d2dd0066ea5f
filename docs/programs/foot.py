from rems_net import Differential, Out
from rems_net.bodies import Box, Encoder, Part, Ray, Sphere, figures, sensed


class Cart(Differential):
    """Two wheels, a foot, and an eye."""

    senses = (
        Encoder("encoder/left", "wheel/left"),
        Ray("eye", at=(0.06, 0, 0), direction=(1, 0, 0), reach=2.0),
    )
    parameters = figures(
        wheel_radius=(0.03, "measured"),
        track=(0.14, "measured"),
        max_wheel_speed=(10.0, "data sheet of the motors"),
        mass=(0.4, "weighed"),
        wheel_torque=(0.2, "data sheet of the motors"),
        wheel_friction=(0.9, "a guess"),
    )
    sensors = Out(sensed("cart.sensors", senses, "measured"))

    def chassis(self, mass):
        foot = Part(Sphere(0.01), 0.01, at=(-0.06, 0, -0.02), friction=0.0)
        board = Part(Box((0.16, 0.1, 0.01)), mass - 0.01, at=(-0.02, 0, 0))
        return board, foot

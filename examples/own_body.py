"""A robot with a body, and an eye that keeps it from the wall. Needs MuJoCo."""

from rems_net import Definition, Experiment, In, Out, Process, Schema, Tick
from rems_net.bodies import Arena, Body, Box, Cylinder, Hinge, Part, Ray, Sphere
from rems_net.units import angle, angular_velocity, length

SPEED = angular_velocity(range=(-10, 10))


class Cart(Definition):
    command = In(Schema("command", {"left": SPEED, "right": SPEED}))
    state = Out(Schema("state", {"x": length(), "y": length(), "heading": angle()}))
    sensors = Out(Schema("sensors", {"front": length()}))

    def body(self) -> Body:  # m, kg; x ahead, y left, z up, from between the wheels
        board = Part(Box((0.10, 0.06, 0.01)), mass=0.2, at=(-0.03, 0, 0))
        tail = Part(Sphere(0.01), mass=0.01, at=(-0.07, 0, -0.02), friction=0.0)
        tyre = Part(Cylinder(0.03, 0.01, axis=(0, 1, 0)), mass=0.02, friction=0.9)
        wheels = [
            Hinge(name, (tyre,), at=(0, y, 0), axis=(0, 1, 0), torque=0.1, droop=1.0)
            for name, y in (("left", 0.05), ("right", -0.05))
        ]
        eye = Ray("front", at=(0.03, 0, 0), direction=(1, 0, 0), reach=2.0)
        return Body((board, tail), tuple(wheels), (eye,), height=0.03)

    def arena(self) -> Arena:
        return Arena(radius=0.5, wall_height=0.1)


class Explore(Process):
    sensors = In(Cart.sensors)
    value = Out(Cart.command)

    def step(self, tick: Tick) -> None:
        near = self.sensors["front"] < 0.15
        self.value = {"left": 6.0, "right": -2.0 if near else 6.0}


lab = Experiment("body", dt="50 ms", duration="30 s")
lab.process("explore", Explore, sensors="robot/cart/sensors")
lab.robot("cart", Cart, "mujoco", command="process/explore")
lab.output("log", "csv")
lab.run()

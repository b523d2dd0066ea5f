from rems_net import Definition, In, Out, Schema
from rems_net.bodies import Devices, Motor, Reading
from rems_net.units import angle, angular_velocity, length


class Rover(Definition):
    command = In(Schema("command", {"left": angular_velocity(range=(-5, 5))}))
    state = Out(Schema("state", {"x": length(), "y": length(), "heading": angle()}))
    sensors = Out(Schema("sensors", {"ahead": length()}))

    def webots(self):
        return Devices(
            motors=(Motor("wheel1", "left"), Motor("wheel2", "left", factor=-1.0)),
            # What it counts is mm.
            readings=(Reading("ahead", "ds_front", factor=0.001),),
            origin=(0.1, 0.0, 0.0),  # our origin is 0.1 m ahead of Webots'
        )

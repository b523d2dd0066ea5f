from rems_net import Definition, In, Out, Schema
from rems_net.bodies import Body, Box, Cylinder, Hinge, Part, Servo, Slide
from rems_net.units import angle, length, ratio

MOVED = {"lift": angle(range=(-1, 1)), "reach": length(range=(0, 0.1))}


class Arm(Definition):
    command = In(Schema("arm.command", MOVED | {"speed": ratio(range=(0, 1))}))
    state = Out(Schema("arm.state", {"lift": angle(), "reach": length()}))

    def body(self):
        def rod(size, mass):
            return (Part(Cylinder(0.01, size), mass, at=(0, 0, size / 2)),)

        reach = Slide(
            "reach",
            rod(0.2, 0.1),
            at=(0, 0, 0.1),
            axis=(0, 0, 1),
            force=20,
            droop=0.05,
            servo=Servo(gain=20, speed=0.1, share="speed"),
            limits=(0, 0.1),
            position="reach",
        )
        lift = Hinge(
            "lift",
            rod(0.3, 0.4),
            at=(0, 0, 0.1),
            axis=(0, 1, 0),
            torque=5,
            droop=0.3,
            servo=Servo(gain=20, speed=1.5, share="speed"),
            position="lift",
            joints=(reach,),
        )
        foot = Part(Box((0.1, 0.1, 0.1)), mass=1, at=(0, 0, 0.05))
        return Body((foot,), (lift,), fixed=True)

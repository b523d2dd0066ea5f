from rems_net import Definition, In, Out, Schema
from rems_net.bodies import Chain, ChainJoint, Pose, toward
from rems_net.drivers import Kinematic, combine
from rems_net.units import angle, ratio

JOINTS = {name: angle(range=(-2, 2)) for name in ("base", "elbow")}


class Planar(Definition):
    command = In(Schema("planar.command", JOINTS | {"speed": ratio(range=(0, 1))}))
    state = Out(Schema("planar.state", JOINTS))

    def advance(self, state, command, dt):  # where the joints are dt seconds later
        most = 2.0 * command["speed"] * dt
        return {name: toward(state[name], command[name], most) for name in JOINTS}

    def mechanisms(self):
        up = (0.0, 0.0, 1.0)
        joints = [
            ChainJoint("base", (0.0, 0.0, 0.1), up, -2.0, 2.0),
            ChainJoint("elbow", (0.3, 0.0, 0.0), up, -2.0, 2.0),
        ]
        return {"arm": Chain(joints, tool=Pose.of((0.2, 0.0, 0.0)))}


arm = combine(Planar, Kinematic)("arm")
arm.prepare()
found = arm.ik((0.3, 0.2, 0.1))
arm.command = found.joints | {"speed": 1.0}
arm.drive(arm.command, 2.0)
assert abs(arm.fk().position - (0.3, 0.2, 0.1)).max() < 1e-9

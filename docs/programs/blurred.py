from rems_net import Woodbot
from rems_net.bodies import Noise
from rems_net.drivers import Kinematic, combine


class Blurred(Woodbot):
    """A Woodbot whose lidars are worse than usual."""

    def noise(self):
        return super().noise() | {"lidar/*": Noise(relative=0.1, absolute=0.005)}


robot = combine(Blurred, Kinematic)("robot", options={"noise": True})
robot.prepare()
robot.open()
robot.sense()
print(robot.sensors)
robot.close()

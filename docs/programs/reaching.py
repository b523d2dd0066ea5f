from rems_net import UnreachableError, Youbot
from rems_net.drivers import Kinematic, combine

robot = combine(Youbot, Kinematic)("bot")
robot.prepare()
try:
    robot.ik((1.2, 0.0, 0.1), of="arm", pitch=0.0)
except UnreachableError as error:
    print(f"{error.away:.2f} m away:", error.nearest.joints)

robot.command = {"linear/y": 0.3}  # a base that drives to the left
robot.drive(robot.command, 1.0)
print(robot.state.x, robot.state.y)
print(robot.ik((0.0, 0.3, 0.0), of="base"))  # rad/s, by wheel

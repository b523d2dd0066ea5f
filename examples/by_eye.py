"""A camera above with two pictures a second: a Woodbot drives to a point by it."""

from math import atan2, hypot, remainder, tau

from rems_net import Experiment, In, Out, Process, Schema, Tick
from rems_net.units import percent

GOAL = (0.2, 0.15)


class ToGoal(Process):
    pose, unsure = (
        In(source="process/fused/state"),
        In(source="process/fused/deviation"),
    )
    value = Out(Schema("speeds", {"wheel": {"left": percent(), "right": percent()}}))

    def step(self, tick: Tick) -> None:
        if not 0 < self.unsure.x < 1:
            return  # not seen yet: nothing is commanded, and the robot stands
        away = GOAL[0] - self.pose.x, GOAL[1] - self.pose.y
        turn = 60 * remainder(atan2(away[1], away[0]) - self.pose.heading, tau)
        ahead = 50.0 if hypot(*away) > 0.01 else 0.0
        turn = turn if ahead else 0.0
        self.value.clip({"wheel/left": ahead - turn, "wheel/right": ahead + turn})


lab = Experiment("by_eye", dt="50 ms", duration="4 s")
marker = {"id": 3, "size": "40 mm"}
lab.robot(
    "bot", "woodbot", "mujoco", world="arena", command="process/drive", marker=marker
)
lens = {"place": {"x": 0.1, "z": 0.9}, "every": 10}
lab.robot("cam", "camera", "mujoco", world="arena", parameters=lens)
one, what = {"robots": "bot"}, {"definition": "woodbot"}
lab.process("eyes", "localise", camera="robot/cam/sensors", options=one)
words = {"command": "robot/bot/command", "pose": "process/eyes/bot"}
lab.process("fused", "ekf", options=what, **words)
lab.process("drive", ToGoal)
lab.output("log", "csv")
lab.run()

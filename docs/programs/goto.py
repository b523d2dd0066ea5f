from rems_net import (
    Experiment,
    In,
    Out,
    Process,
    Schema,
    Settings,
    Woodbot,
    atan2,
    cos,
    hypot,
    sin,
)
from rems_net.units import length, percent


class GoTo(Process):
    """Turns towards a point, drives there, and stops."""

    options = Settings(x=length(default=0.2), y=length(default=0.2))
    robot = In(Woodbot.state)
    wheels = Out(Schema("wheels", {"wheel": {"left": percent(), "right": percent()}}))

    def step(self, tick):
        dx = self.options["x"] - self.robot["x"]
        dy = self.options["y"] - self.robot["y"]
        error = atan2(dy, dx) - self.robot["heading"]
        turn = 60 * atan2(sin(error), cos(error))
        ahead = min(50, 400 * hypot(dx, dy))
        self.wheels.clip({"wheel": {"left": ahead - turn, "right": ahead + turn}})


lab = Experiment("goto", dt="20 ms", duration="10 s")
for name in ("kinematic", "mujoco"):
    lab.process(f"pilot_{name}", GoTo, robot=f"robot/{name}/state")
    lab.robot(name, "woodbot", name, command=f"process/pilot_{name}")
lab.output("log", "csv")
lab.run()

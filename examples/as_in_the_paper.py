"""Seven simulated robots and three emulated: all from one input, then each its own."""

from math import sin

from rems_net import Experiment, Input, Out, Schema, Settings
from rems_net.defdict import number, percent
from rems_net.emulators.known import emulated

WHEELS = ("left", "right", "front/left", "front/right", "rear/left", "rear/right")
SIMULATED = ("woodbot", "create2", "epuck", "pioneer3dx", "pioneer3at", "moose")
WOODBOT = "woodbot-websocket"


class Weave(Input):
    options = Settings(phase=number())
    value = Out(Schema("wheels", {f"wheel/{name}": percent() for name in WHEELS}))

    def read(self, tick):  # percent of full speed, for two wheels and for four
        swing = 10 * sin(2 * tick.t + self.options.phase)
        sides = {"left": 20 + swing, "right": 20 - swing}
        return {f"wheel/{name}": sides[name.rpartition("/")[2]] for name in WHEELS}


def run(name, robots, *, own):
    lab = Experiment(name, duration="4 s", pace=1)
    for i, (robot, (definition, driver, options)) in enumerate(robots.items()):
        hand = f"hand_{robot}" if own else "hand"
        if own or i == 0:
            lab.input(hand, Weave, phase=i, host="hands")
        told = {"command": f"input/{hand}", "options": options}
        lab.robot(robot, definition, driver, **told, host=driver)
    lab.output("log", "csv")
    lab.run()


if __name__ == "__main__":  # not in the agents' processes, which read it, too
    robots = {name: (name, "mujoco", {}) for name in (*SIMULATED, "youbot_base")}
    with emulated("create2") as a, emulated("dynabot") as b, emulated(WOODBOT) as c:
        robots |= {
            "create2-real": ("create2", "create2", {"port": a.where}),
            "dynabot-real": ("dynabot", "dynabot", {"port": b.where}),
            "woodbot-real": ("woodbot", WOODBOT, {"url": c.where}),
        }
        run("one_input", robots, own=False)
        run("own_inputs", robots, own=True)

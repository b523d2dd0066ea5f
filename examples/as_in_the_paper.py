"""Seven simulated robots and three emulated: all from one input, then each its own."""

from contextlib import ExitStack
from typing import Any

from rems_net import Experiment, Input, Out, Schema, Settings, Tick, sin
from rems_net.drivers import emulated
from rems_net.units import number, percent

SIMULATED = ("woodbot", "create2", "epuck", "pioneer3dx", "pioneer3at", "moose")
FIELDS = ("wheel/left", "wheel/right", "linear/x", "linear/y", "angular/z")
DEVICES = {"create2": "port", "dynabot": "port", "woodbot-ws": "url"}


class Weave(Input):
    options = Settings(phase=number())
    value = Out(Schema("weave", dict.fromkeys(FIELDS, percent())))

    def read(self, tick: Tick) -> dict[str, float]:  # of full speed
        swing = 10 * sin(2 * tick.t + self.options.phase)
        return dict(zip(FIELDS, (20 + swing, 20 - swing, 20, 0, -swing), strict=True))


def run(name: str, robots: dict[str, Any], *, own: bool) -> None:
    lab = Experiment(name, duration="4 s", pace=1)
    for i, (robot, (definition, driver, told)) in enumerate(robots.items()):
        hand = f"hand_{robot}" if own else "hand"
        if own or i == 0:
            lab.input(hand, Weave, options={"phase": i}, host="hands")
        told["command"] = f"input/{hand}"
        lab.robot(robot, definition, driver, **told, host=driver)
    lab.output("log", "csv")
    lab.run()


if __name__ == "__main__":  # not in the agents' processes, which read it, too
    names = (*SIMULATED, "youbot_base")
    robots: dict[str, Any] = {name: (name, "mujoco", {}) for name in names}
    with ExitStack() as stack:
        for driver, option in DEVICES.items():
            told = {"options": {option: stack.enter_context(emulated(driver)).where}}
            robots[f"{driver}-real"] = (driver.removesuffix("-ws"), driver, told)
        run("one_input", robots, own=False)
        run("own_inputs", robots, own=True)

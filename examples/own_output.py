"""An output writes one method, `write`: what to do with this tick's values."""

from pathlib import Path

from rems_net import Experiment, In, Output, Tick, Woodbot


class Say(Output):
    state = In(Woodbot.state)

    def write(self, tick: Tick) -> None:
        if tick.n % 10 == 0:
            print(f"{tick.t:.1f} s: x = {self.state['x']:.3f} m", flush=True)


lab = Experiment("say", duration="5 s", folder=Path(__file__).parent)
lab.input("keys", "csv", options={"file": "keys.csv"})
lab.robot("sim", "woodbot", "kinematic", command="input/keys")
lab.output("mouth", Say, state="robot/sim/state")
lab.run()

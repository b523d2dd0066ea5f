"""How long a short run takes, with the start of Python: first tick, and all of it.

python -m benchmarks.programs.start processes|direct|numpy SECONDS

processes, direct: `rems run weave.py`, an experiment as the README's, of SECONDS of
fabric time, without and with `--direct`. numpy: only `import numpy`, the floor.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

WEAVE = """\
import time

from rems_net import Definition, Experiment, In, Input, Out, Schema
from rems_net.defdict import angle, angular_velocity, length, velocity
from rems_net.maths import cos, sin


class Cart(Definition):
    command = In(Schema("command", {{"speed": velocity(), "turn": angular_velocity()}}))
    state = Out(Schema("state", {{"x": length(), "y": length(), "heading": angle()}}))

    def derivative(self, state, command):
        v, turn, heading = command["speed"], command["turn"], state["heading"]
        return {{"x": v * cos(heading), "y": v * sin(heading), "heading": turn}}


class Weave(Input):
    value = Out(Cart.command)

    def read(self, tick):
        if tick.n == 1:
            with open("first", "w") as file:
                file.write(repr(time.time()))
        return {{"speed": 0.2, "turn": cos(tick.t)}}


lab = Experiment("weave", dt="50 ms", duration="{seconds} s")
lab.input("driver", Weave)
lab.robot("cart", Cart, "kinematic", command="input/driver")
lab.output("log", "csv")
lab.run()
"""


def main() -> None:
    way, seconds = sys.argv[1:]
    words = ["-m", "rems_net", "run", "weave.py"]
    if way == "direct":
        words.insert(3, "--direct")
    if way == "numpy":
        words = ["-c", "import numpy"]
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "weave.py").write_text(WEAVE.format(seconds=seconds), "utf-8")
        wall, begun = time.time(), time.perf_counter()
        subprocess.run(
            [sys.executable, *words], cwd=folder, check=True, stdout=sys.stderr
        )
        result = {"whole": time.perf_counter() - begun}
        if way != "numpy":
            result["first"] = float(Path(folder, "first").read_text("utf-8")) - wall
    print(json.dumps(result))


if __name__ == "__main__":
    main()

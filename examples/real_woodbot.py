"""A Woodbot's own firmware beside its models, from one input: how far are they apart?

First, each in a terminal of its own, with a real Woodbot or without:

    rems router serve
    rems board emulate woodbot --name woodbot-7
"""

from importlib.util import find_spec
from pathlib import Path

from rems_net import Experiment

lab = Experiment(
    "real", dt="20 ms", pace=1.0, fabric="real", folder=Path(__file__).parent
)
lab.input("keys", "csv", options={"file": "keys.csv"})
for driver in ("kinematic", "mujoco", "pybullet"):
    if driver == "kinematic" or find_spec(driver):  # those that are installed
        lab.robot(driver, "woodbot", driver, command="input/keys")
lab.robot("woodbot-7", "woodbot", "remote", command="input/keys")
lab.output("log", "csv")
result = lab.run()
for pair in result.compare():
    print(pair)
result.plot()

"""One definition, three drivers: change one word to change how a robot is done."""

from pathlib import Path

from rems_net import Experiment

lab = Experiment("three", dt="50 ms", duration="5 s", folder=Path(__file__).parent)
lab.input("keys", "csv", options={"file": "keys.csv"})
for driver in ("kinematic", "mujoco", "pybullet"):
    lab.robot(driver, "woodbot", driver, command="input/keys")
lab.output("log", "csv")
lab.run()

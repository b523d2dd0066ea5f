from rems_net import Experiment
from rems_net.gym import make_parallel

lab = Experiment("pair", dt="50 ms", duration="10 s")
for name in "ab":
    lab.robot(name, "woodbot", "kinematic")
act = {name: f"robot/{name}/command" for name in "ab"}
observe = {name: f"robot/{name}/state" for name in "ab"}
env = make_parallel(lab, act=act, observe=observe, reward={"a": "x", "b": "-x"})
observations, infos = env.reset(seed=1)

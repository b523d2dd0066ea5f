"""Train a policy by numpy alone to drive to a goal; try it in three other places."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from rems_net import Experiment
from rems_net.gym import make as environment

GOAL, TRIES, ROUNDS = (0.2, 0.15), 24, 12
NOW, BEFORE = "hypot(x - 20 cm, y - 15 cm)", "hypot(before.x - 20 cm, before.y - 15 cm)"


def make(driver: str, **more: Any) -> Any:
    lab = Experiment("train", dt="100 ms", duration="6 s")
    lab.robot("sim", "woodbot", driver)
    more |= {"act": "robot/sim/command", "observe": "robot/sim/state"}
    more |= {"reward": f"{BEFORE} - {NOW}", "ends": f"{NOW} < 2 cm", "normalise": True}
    return environment(lab, start={"robot/sim.heading": "-180..180 deg"}, **more)


def drive(env: Any, weights: Any, seed: int) -> tuple[float, Any]:
    (x, y, heading), _ = env.reset(seed=seed)
    path, total, over = [(x, y)], 0.0, False
    while not over:  # the policy sees the goal ahead and to the left, and a one
        dx, dy, c, s = GOAL[0] - x, GOAL[1] - y, np.cos(heading), np.sin(heading)
        seen = np.array([dx * c + dy * s, dy * c - dx * s, 1.0]) / np.hypot(dx, dy)
        (x, y, heading), reward, ended, cut, _ = env.step(np.tanh(weights @ seen))
        path, total, over = [*path, (x, y)], total + reward, ended or cut
    return total, np.array(path)


if __name__ == "__main__":
    random, env = np.random.default_rng(1), make("kinematic")
    middle, spread = np.zeros((2, 3)), np.full((2, 3), 2.0)
    for n in range(ROUNDS):  # cross-entropy: the best six tries are varied
        tries = middle + spread * random.normal(size=(TRIES, 2, 3))
        gains = [sum(drive(env, one, 4 * n + i)[0] for i in range(4)) for one in tries]
        best = tries[np.argsort(gains)[-6:]]
        middle, spread = best.mean(axis=0), best.std(axis=0) + 0.05
    there = {"mujoco": make("mujoco"), "fabric": make("mujoco", fabric=True)}
    for name, place in {"kinematic": env, **there}.items():
        path = drive(place, middle, seed=1000)[1]
        place.close()
        print(f"{name}: {np.hypot(*(path[-1] - GOAL)):.3f} m from the goal")
        plt.plot(*path.T, "--" if name == "fabric" else "-", label=name)
    plt.plot(*GOAL, "k+", label="goal")
    plt.gca().set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    plt.legend().get_figure().savefig("paths.png")  # type: ignore[union-attr]

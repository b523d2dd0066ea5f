"""Environments beside the engine, bare MuJoCo, and each other, in one process.

python -m benchmarks.programs.gym STEPS COPIES

The ways take turns, and the fastest of some rounds counts: it was disturbed the least.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from importlib.util import find_spec
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import msgpack
import numpy as np

import rems_net.gym
from benchmarks.programs import raw_zenoh
from rems_net import Experiment, Input, Out, Tick, Woodbot
from rems_net.libraries import load

#: Many short ones: a machine that is shared is fast for parts of a second.
ROUNDS = 25
STATE, SENSORS = "robot/sim/state", "robot/sim/sensors"
PORTS: dict[str, Any] = {"act": "robot/sim/command", "observe": STATE}
COMMAND = {"wheel/left": 3.0, "wheel/right": 2.0}
START = {"robot/sim.x": "-10..10 cm", "robot/sim.heading": "-180..180 deg"}
Way = Callable[[int], object]


class Steady(Input):
    """An input that sends the same command at every tick."""

    value = Out(Woodbot.command)

    def read(self, tick: Tick) -> dict[str, float]:
        return COMMAND


def lab(driver: str, **more: Any) -> Experiment:
    made = Experiment("gym", dt="10 ms", duration=1e5, record=False)
    made.robot("sim", "woodbot", driver, **more)
    return made


def stepping(env: Any, action: Any) -> Way:
    """Return what takes that many steps of an environment."""
    env.reset(seed=1)

    def go(steps: int) -> None:
        for _ in range(steps):
            env.step(action)

    return go


def by_hand(engine: Any) -> Way:
    """Return what an environment does, in the words of an engine."""
    sim = engine["robot/sim"]

    def go(steps: int) -> None:
        for _ in range(steps):
            engine.put("robot/sim/command", COMMAND)
            engine.step()
            np.array(sim.state.leaves())

    return go


def resetting(env: Any) -> Way:
    def go(steps: int) -> None:
        for seed in range(steps):
            env.reset(seed=seed)

    return go


def bare(env: Any) -> Way:
    """Return what takes ticks of bare mj_step, in the model of an environment."""
    world: Any = env._stage._engine["robot/sim"]._world
    mujoco, engine = load("mujoco", "mujoco"), world._engine

    def go(steps: int) -> None:
        for _ in range(steps):
            mujoco.mj_step(engine._model, engine._data, 10)

    return go


@contextmanager
def raw() -> Iterator[Way]:
    """Give what takes steps by zenoh-python alone: a command and a tick, then a state.

    The floor of an environment on a fabric: the same messages between two processes.
    """
    heard: SimpleQueue[Any] = SimpleQueue()
    program = [sys.executable, "-m", "benchmarks.programs.raw_zenoh"]
    with raw_zenoh.open_session(serve=True) as session:
        state, laws = raw_zenoh.STATES, raw_zenoh.LAWS
        hear = session.declare_subscriber(state, raw_zenoh.direct(heard))
        act = session.declare_publisher(raw_zenoh.COMMAND, **laws)
        tick = session.declare_publisher(raw_zenoh.TICK, **laws)
        agent = subprocess.Popen([*program, "agent", "0", "1", "acted"])
        while not list(session.liveliness().get(raw_zenoh.ALIVE)):
            time.sleep(0.05)
        time.sleep(0.3)

        def go(steps: int) -> None:
            for n in range(1, steps + 1):
                act.put(msgpack.packb(COMMAND), attachment=msgpack.packb((n, n * 0.01)))
                tick.put(msgpack.packb({"n": n, "t": n * 0.01, "dt": 0.01}))
                np.array([*msgpack.unpackb(heard.get().payload.to_bytes()).values()])

        yield go
        tick.put(msgpack.packb({"n": 0}))
        agent.wait()
        del hear


def rates(ways: dict[str, Way], steps: int) -> dict[str, float]:
    """Return the steps a second of each way, in its fastest round."""
    found = dict.fromkeys(ways, 0.0)
    for _ in range(ROUNDS):
        for name, way in ways.items():
            begun = time.perf_counter()
            way(steps)
            rate = steps / (time.perf_counter() - begun)
            found[name] = max(found[name], rate)
    return found


def main() -> None:
    steps, copies = int(sys.argv[1]), int(sys.argv[2])
    make, action = rems_net.gym.make, np.array([3.0, 2.0])
    with_input = lab("kinematic", command="input/steady")
    with_input.input("steady", Steady)
    seen = {**PORTS, "observe": [STATE, SENSORS]}
    plain = lab("kinematic").engine().open()
    ticking = with_input.engine().open()
    found = rates(
        {
            "engine": by_hand(plain),
            "env": stepping(make(lab("kinematic"), **PORTS), action),
            "input": ticking.step,
        },
        steps,
    )
    many = make(lab("kinematic"), vector=copies, **seen)
    one = stepping(make(lab("kinematic"), **seen), action)
    actions = np.tile(action, (copies, 1))
    some = rates({"columns": stepping(many, actions), "one": one}, max(1, steps // 20))
    found |= {"columns": some["columns"] * copies, "one": some["one"]}
    if find_spec("mujoco") is not None:
        env = make(lab("mujoco"), start=START, **seen)
        ways = {"mujoco": stepping(env, action), "bare": bare(env)}
        threads = make(lab("mujoco"), vector=8, **seen)
        ways["threads"] = stepping(threads, actions[:8])
        some = rates(ways, max(1, steps // 10))
        found |= some | {"threads": some["threads"] * 8}
        found["reset"] = rates({"reset": resetting(env)}, max(1, steps // 10))["reset"]
    with tempfile.TemporaryDirectory() as folder:
        out, ways = Path(folder, "out"), {}
        with ExitStack() as stack:
            for name, host in (("fabric", "one"), ("here", "here")):
                made = lab("kinematic", host=host)
                made.fabric = name
                env = make(made, fabric=True, out=out / name, **PORTS)
                ways[name] = stepping(stack.enter_context(closing(env)), action)
            ways["zenoh"] = stack.enter_context(raw())
            found |= rates(ways, steps)
    print(json.dumps(found))


if __name__ == "__main__":
    main()

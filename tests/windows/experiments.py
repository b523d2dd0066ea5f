"""Twenty experiments, side by side, which give the same bytes on every system.

    python -m tests.windows.experiments OUT

They are run in this process (OUT/one), and with their agents in four (OUT/many).
"""

import sys
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path

import numpy as np

from rems_net import Experiment, In, Input, Out, Process, Schema, Settings, Tick
from rems_net.agents.experiment.show import Show
from rems_net.defdict import angular_velocity, array, boolean, number
from rems_net.maths import cos, sin
from tests.engine import parts

#: processes of agents in turn; the clock and the recorder have two more
HOSTS = ("first", "second", "third")
HERE, PARTS = "tests.windows.experiments", "tests.engine.parts"
WHEELS = Schema("wheels", {"wheel": {s: angular_velocity() for s in ("left", "right")}})
GRID = Schema("grid", {"cells": array((3, 4), "m", dtype="f4"), "total": number()})


class Weave(Input):
    """Wheels that turn in waves."""

    value = Out(WHEELS)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"wheel/left": 4 + 2 * sin(tick.t), "wheel/right": 4 - sin(0.7 * tick.t)}


class Shaky(Input):
    """Wheels with noise, of Python's generator and of NumPy's."""

    value = Out(WHEELS)

    def open(self) -> None:
        self.rng = np.random.default_rng(self.random.getrandbits(64))

    def read(self, tick: Tick) -> dict[str, float]:
        left = 4 + self.random.gauss(0, 0.3)
        return {"wheel/left": left, "wheel/right": self.rng.normal(4, 0.3)}


class Grid(Process):
    """Puts where a cart is into an array."""

    state = In(parts.STATE)
    value = Out(GRID)

    def step(self, tick: Tick) -> None:
        cells = np.arange(12.0).reshape(3, 4) * self.state.x + self.state.y
        self.value = {"cells": cells, "total": float(cells[0, 0] + cells[2, 3])}


class Middle(Process):
    """Drives to the middle of a swarm; `sum` adds otherwise since Python 3.12."""

    birds = In()
    value = Out(parts.COMMAND)

    def step(self, tick: Tick) -> None:
        x = 0.0
        for bird in self.birds.values():
            x += bird.x
        speed = max(-1.0, min(1.0, 0.1 - x / max(1, len(self.birds))))
        self.value = {"speed": speed, "turn": 0.1}


class Planner(Process):
    """Turns a cart by the result of a job that was submitted ten ticks before."""

    options = Settings(process=boolean(default=False))
    state = In(parts.STATE)
    value = Out(parts.COMMAND)
    turn = 0.0

    def step(self, tick: Tick) -> None:
        if tick.n % 10 == 1:
            beside = bool(self.options.process)
            self.jobs.submit(plan, self.state.x, then=self.take, due=10, process=beside)
        self.value = {"speed": 0.3, "turn": self.turn}

    def take(self, turn: float) -> None:
        self.turn = turn


def plan(x: float) -> float:
    """Return a turn in rad/s, after much computing."""
    for _ in range(1000):
        x = cos(x)
    return x


Add = Callable[[Experiment, str], None]


def carts(
    source: str,
    process: str = "",
    *,
    count: int = 2,
    every: int = 1,
    options: Mapping[str, object] | None = None,
    **ins: str,
) -> Add:
    """Return what adds carts with an input, or with a process between the two."""

    def add(lab: Experiment, name: str) -> None:
        lab.input(name, f"{PARTS}:{source}")
        if process:
            where = {port: key.format(name) for port, key in ins.items()}
            lab.process(name, process, options=options, **where)
        for i in range(count):
            lab.robot(
                f"{name}_{i}",
                f"{PARTS}:Cart",
                "kinematic",
                command=f"{'process' if process else 'input'}/{name}",
                initial={"x": 0.1 * i},
                every=1 + i % every,
            )

    return add


def robots(definition: str, driver: str = "kinematic", **options: object) -> Add:
    """Return what adds a robot that goes smoothly, and one that is shaken."""

    def add(lab: Experiment, name: str) -> None:
        for source in (Weave, Shaky):
            mine = f"{name}_{source.__name__.lower()}"
            lab.input(mine, f"{HERE}:{source.__name__}")
            lab.robot(
                mine, definition, driver, command=f"input/{mine}", options=options
            )

    return add


def grid(lab: Experiment, name: str) -> None:
    carts("Wave")(lab, name)
    lab.process(name, f"{HERE}:Grid", state=f"robot/{name}_0/state")


def late(lab: Experiment, name: str) -> None:
    carts("Wave")(lab, name)
    command = f"input/{name}"
    lab.robot(f"{name}_2", f"{PARTS}:Cart", "kinematic", command=command, since="1 s")


def estimates(lab: Experiment, name: str) -> None:
    robots("woodbot", noise=True)(lab, name)
    for kind in ("ekf", "ukf"):
        lab.process(
            f"{name}_{kind}",
            kind,
            command=f"input/{name}_weave",
            sensors=f"robot/{name}_weave/sensors",
            options={"definition": "woodbot", "slip": 0.06},
        )


def worlds(driver: str) -> Add:
    """Return what adds two worlds, each with a robot and a ball before it."""

    def add(lab: Experiment, name: str) -> None:
        lab.input(name, f"{HERE}:Weave")
        for world in (f"{name}_north", f"{name}_south"):
            ball = {"name": "ball", "radius": "2 cm", "x": 0.1, "mass": "10 g"}
            lab.world(world, options={"radius": "0.6 m", "balls": [ball]})
            lab.robot(world, "woodbot", driver, command=f"input/{name}", world=world)

    return add


STATE = "robot/{}_0/state"
#: experiments by name, one for each kind of part, and those that are one run
LABS: dict[str, dict[str, Add]] = {
    "carts": {
        "units": carts("Slow"),
        "percent": carts("Stick"),
        "wave": carts("Wave"),
        "rates": carts("Wave", every=3),
        "late": late,
        "array": grid,
        "following": carts(
            "Wave", f"{PARTS}:Follow", one=STATE, other="robot/{}_1/state"
        ),
        "swarm": carts("Wave", f"{HERE}:Middle", count=12, birds="robot/{}_*/state"),
    },
    "robots": {
        "woodbot": robots("woodbot"),
        "rk4": robots("woodbot", integrator="rk4"),
        "noise": robots("woodbot", noise=True),
        "epuck": robots("epuck", noise=True),
        "create2": robots("create2"),
        "pioneer": robots("pioneer3dx", noise=True),
        "moose": robots("moose"),
        "estimates": estimates,
        "worlds": worlds("kinematic"),
    },
    "jobs": {
        "threads": carts("Wave", f"{HERE}:Planner", state=STATE),
        "cores": carts(
            "Wave", f"{HERE}:Planner", options={"process": True}, state=STATE
        ),
    },
    "physics": {
        "mujoco": robots("woodbot", "mujoco"),
        "mujoco_worlds": worlds("mujoco"),
    },
}


def made(name: str, *, spread: bool) -> Experiment:
    """Return all experiments of a table; spread: over processes."""
    lab = Experiment(name, dt="50 ms", duration="2 s", seed=7)
    for word, add in LABS[name].items():
        add(lab, word)
    lab.output("log", "csv")
    if spread:
        for i, plan in enumerate(lab.plans.values()):
            if not plan.world:
                plan.host = HOSTS[i % len(HOSTS)]
    return lab


def main() -> None:
    out = Path(sys.argv[1])
    python = ".".join(map(str, sys.version_info[:3]))
    print(f"Python {python}, NumPy {np.__version__}, MuJoCo {version('mujoco')}")
    for name in LABS:
        for way in ("one", "many"):
            lab = made(name, spread=way == "many")
            lab.run(out / way / name, direct=way == "one", pace="fast", show=Show())


if __name__ == "__main__":
    main()

"""Many robots in one host, stepped as arrays: the same bytes as one by one."""

import math
from pathlib import Path

import pytest

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.ports import In, Out
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.robot import Definition, combine
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict, Schema, length, velocity
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.kinematic.swarm import Swarm
from rems_net.robots.woodbot import Woodbot
from rems_net.router.mail import Mail, Mailbox
from tests.agents.parts import Cart
from tests.agents.runs import PARTS, Told


@pytest.mark.parametrize("integrator", ["euler", "rk4"])
@pytest.mark.parametrize("size", [2, 3, 7, 64, 101])
def test_a_swarm_steps_as_its_robots_do_to_the_last_bit(
    integrator: str, size: int
) -> None:
    kind = combine(Woodbot, Kinematic)

    def make(i: int) -> Kinematic:
        initial = {"x": 0.01 * i, "heading": 0.37 * i}
        options = {"integrator": integrator}
        robot = kind(f"bot{i}", initial=initial, options=options)
        robot.prepare()
        assert isinstance(robot, Kinematic)
        return robot

    alone, together = [make(i) for i in range(size)], [make(i) for i in range(size)]
    swarm = Swarm.of(together)
    assert swarm is not None
    for n in range(1, 30):
        tick = Tick(n, n / 10, 0.1)
        for i, pair in enumerate(zip(alone, together, strict=True)):
            for robot in pair:
                command = {"left": 7 * math.sin(i + n), "right": 6 * math.cos(i * n)}
                robot.command = {"wheel": command}
        for robot in alone:
            robot.step(tick)
        swarm.step(tick)
        for a, b in zip(alone, together, strict=True):
            assert a.state.encode() == b.state.encode()
            assert a.sensors.encode() == b.sensors.encode()


def test_who_watches_from_the_start_misses_no_tick(tmp_path: Path) -> None:
    class Watch(Told):
        def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
            clock.session.watch("rems/robot/*/state", seen)

    seen = Mailbox()
    lab = Experiment("crowd", dt=0.1, duration="2 s", folder=PARTS)
    lab.record = False
    for i in range(400):
        host = "process" if i % 2 else HERE
        lab.robot(f"r{i}", "parts.py:Cart", "parts.py:Euler", host=host)
    lab.run(tmp_path, show=Watch())
    count = 0
    while isinstance(seen.get(1.0), Mail):
        count += 1
    assert count == 400 * 20


class Careful(Cart):
    """Its mathematics takes numbers only."""

    def derivative(self, state: dict[str, float], command: dict[str, float]) -> object:
        speed, heading = command["speed"], state["heading"]
        return {"x": speed * math.cos(heading), "y": speed * math.sin(heading)}


def test_mathematics_that_takes_no_arrays_is_stepped_one_by_one() -> None:
    kind = combine(Careful, Kinematic)
    robots = [kind(name) for name in "ab"]
    for robot in robots:
        robot.prepare()
    assert Swarm.of([r for r in robots if isinstance(r, Kinematic)]) is None


class Bare(Definition):
    """It senses nothing."""

    command = In(Schema("bare.command", {"speed": velocity()}))
    state = Out(Schema("bare.state", {"x": length()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, float]:
        return {"x": command["speed"]}


def test_a_swarm_that_senses_nothing() -> None:
    robots = [combine(Bare, Kinematic)(name) for name in "abc"]
    for i, robot in enumerate(robots):
        robot.prepare()
        robot.command = {"speed": 0.5 * i}
    swarm = Swarm.of([r for r in robots if isinstance(r, Kinematic)])
    assert swarm is not None
    swarm.step(Tick(1, 0.1, 0.1))
    assert [r.state["x"] for r in robots] == [0.0, 0.05, 0.1]


def test_hosts_make_no_difference(tmp_path: Path) -> None:
    def lab() -> Experiment:
        made = Experiment("swarm", dt=0.05, duration=2, folder=PARTS, record=False)
        for i in range(6):
            made.input(
                f"in{i}", "parts.py:Wheels", options={"phase": 0.3 * i}, host=HERE
            )
            made.robot(
                f"bot{i}",
                "woodbot",
                "kinematic",
                command=f"input/in{i}",
                host="alone" if i == 5 else f"h{i // 3}",
            )
        made.output("log", "parts.py:Log", host=HERE)
        return made

    one, many = tmp_path / "one", tmp_path / "many"
    lab().run(one, direct=True)
    lab().run(many, show=Told())
    lines = (one / "log.txt").read_bytes()
    assert len(set(lines.splitlines())) == 40 * 18
    assert (many / "log.txt").read_bytes() == lines

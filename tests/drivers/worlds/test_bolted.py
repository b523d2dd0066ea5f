"""Arms that are bolted down: where `initial` says, whoever does them."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import pi
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.protocol.plan import Plan
from rems_net.errors import ExperimentError
from tests.drivers.worlds.test_shared import DT, each, engines

RIGHT = {"x": "40 cm", "heading": "180 deg"}
READY = {"arm/joint/2": 0.3}


def bench(driver: str, *arms: dict[str, Any]) -> Experiment:
    lab = Experiment("bench", dt=DT, duration="1 s")
    lab.world("bench", options={"size": [3.0, 3.0]})
    for name, initial in zip("ab", arms, strict=False):
        lab.robot(name, "youbot_arm", driver, world="bench", initial=initial)
    return lab


@contextmanager
def opened(lab: Experiment) -> Iterator[list[Any]]:
    agents: dict[str, Any] = dict(lab.check())
    robots = [agent for key, agent in agents.items() if key.startswith("robot/")]
    for robot in robots:
        robot.open()
    yield robots
    for robot in robots:
        robot.close()


@each
def test_others_see_it_where_it_stands(driver: str) -> None:
    lab = bench(driver, {}, RIGHT | READY)
    lab.robot("eye", "woodbot", driver, world="bench", initial={"x": 0.15})
    with opened(lab) as (_, arm, eye):
        assert arm.place == pytest.approx((0.4, 0.0, pi))
        assert arm.state["arm/joint/2"] == pytest.approx(0.3, abs=2e-3)
        for _ in range(2):
            eye.shared.advance(DT)
            eye.sense()
            # From the lens to the foot.
            seen = 0.4 - 0.06 - 0.15 - 0.00825
            assert eye.sensors["lidar/front"] == pytest.approx(seen, abs=3e-3)
            arm.reset()


@engines
def test_two_that_face_each_other_meet(driver: str) -> None:
    """One leans as it is told; of two that lean at each other the elbows give way."""
    off = []
    for there in ({"x": -1.0}, RIGHT):
        with opened(bench(driver, {}, there)) as robots:
            for robot in robots:
                robot.command = {"arm/joint/2": 0.7, "arm/speed": 1.0}
            for _ in range(40):
                robots[0].shared.advance(DT)
            robots[0].sense()
            joints = [f"arm/joint/{number}" for number in range(1, 6)]
            now, told = robots[0].state, robots[0].command
            off.append(max(abs(now[path] - told[path]) for path in joints))
    alone, facing = off
    assert alone < 0.02
    assert facing > 0.15


@each
def test_two_in_one_place_are_told_how_to_part(driver: str) -> None:
    with pytest.raises(ExperimentError, match=r"robot/b starts at .*robot/a") as why:
        bench(driver, {}, READY).check()
    assert "give robot/b another `initial`, such as { x = " in str(why.value)


def test_its_host_is_told_where() -> None:
    lab = bench("kinematic", RIGHT | READY)
    table = lab.plans["robot/a"].table(lab.check()["robot/a"], lab.dt)
    agent: Any = Plan.read("robot", table, lab.folder, lab.dt).build()
    agent.prepare()
    assert agent.place == pytest.approx((0.4, 0.0, pi))
    assert agent.state["arm/joint/2"] == 0.3


def test_what_is_no_place_is_refused() -> None:
    with pytest.raises(ExperimentError, match="no field 'z'"):
        bench("kinematic", {"z": 1.0}).check()

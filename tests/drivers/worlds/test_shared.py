"""Robots that share a world: they touch and see each other, whoever does it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import hypot
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.world import World
from rems_net.bodies.body import Body, Cylinder, Part
from rems_net.errors import AgentError, ExperimentError
from rems_net.robots.woodbot import Woodbot
from tests.drivers.physics.test_physics import needs

DRIVERS = [
    "kinematic",
    pytest.param("mujoco", marks=needs("mujoco")),
    pytest.param("pybullet", marks=needs("pybullet")),
]
each = pytest.mark.parametrize("driver", DRIVERS)
engines = pytest.mark.parametrize("driver", DRIVERS[1:])
DT = 0.05
#: what they are told, each by what its command has, so that they go ahead
FORWARD = ("wheel/left", "wheel/right", "linear/x")
Go = Callable[..., None]


class Tall(Woodbot):
    """A Woodbot with a mast, which others see; their lidars look along its board."""

    def body(self) -> Body:
        body = super().body()
        mast = Part(Cylinder(0.02, 0.03), 1e-3, at=(0.0, 0.0, 0.01))
        return replace(body, parts=(*body.parts, mast))


@contextmanager
def opened(driver: str, *places: dict[str, Any], **scene: Any) -> Iterator[Any]:
    """The world and its robots a, b, ..., and what drives them all."""
    lab = Experiment("shared", dt=DT, duration="1 s")
    lab.world("arena", options=scene)
    names = "abcdef"[: len(places)]
    for name, place in zip(names, places, strict=True):
        lab.robot(name, Tall, driver, world="arena", initial=place)
    agents: dict[str, Any] = dict(lab.check())
    world = agents["world/arena"]
    robots = [agents[f"robot/{name}"] for name in names]

    def go(seconds: float, *shares: tuple[float, float]) -> None:
        for robot, (left, right) in zip(robots, shares, strict=True):
            top = robot.parameters.max_wheel_speed
            robot.command = {"wheel/left": left * top, "wheel/right": right * top}
        for _ in range(round(seconds / DT)):
            robots[0].shared.advance(DT)
            for robot in robots:
                robot.sense()
        world.step(None)

    try:
        for robot in robots:
            robot.open()
            robot.sense()
        yield world, robots, go
    finally:
        for robot in robots:
            robot.close()


def numbers(robot: Any) -> list[float]:
    return [robot.sensors[path] for path in robot.sensors.schema.paths]


FACING = {"x": -0.1}, {"x": 0.1, "heading": "180 deg"}
AHEAD, STILL = (1.0, 1.0), (0.0, 0.0)


@each
def test_they_see_each_other(driver: str) -> None:
    with opened(driver, *FACING, size=[2.0, 2.0]) as (_, (a, b), go):
        before = a.sensors["lidar/front"]
        # From the lens to the mast of the other.
        assert before == pytest.approx(0.2 - 0.00825 - 0.02, abs=1e-3)
        assert b.sensors["lidar/front"] == pytest.approx(before, abs=1e-3)
        go(0.5, AHEAD, STILL)
        came = a.state["x"] + 0.1
        assert came > 0.05
        assert a.sensors["lidar/front"] == pytest.approx(before - came, abs=2e-3)
        assert b.sensors["lidar/front"] == pytest.approx(before - came, abs=2e-3)


@each
def test_they_stop_each_other(driver: str) -> None:
    """Nose to nose at the same speed, nobody gets through."""
    with opened(driver, *FACING, size=[2.0, 2.0]) as (_, (a, b), go):
        go(1.5, AHEAD, AHEAD)
        gap = b.state["x"] - a.state["x"]
        assert 0.01 < gap < 0.06


@engines
def test_one_pushes_another(driver: str) -> None:
    with opened(driver, *FACING, size=[2.0, 2.0]) as (_, (a, b), go):
        go(2.0, AHEAD, (-0.3, -0.3))
        assert b.state["x"] > 0.15
        assert a.state["x"] > 0.05


SCENE: dict[str, Any] = {
    "size": [1.0, 1.0],
    "boxes": [
        {"name": "crate", "size": [0.06, 0.2, 0.06], "x": 0.1, "mass": "50 g"},
        {"name": "rock", "size": [0.1, 0.1, 0.1], "x": -0.2, "y": 0.3},
    ],
    "balls": [{"name": "ball", "radius": "2 cm", "y": -0.3, "x": 0.1, "mass": 0.02}],
}


@each
def test_things_are_in_the_way(driver: str) -> None:
    """A crate that can be pushed is, by an engine; for mathematics it is a wall."""
    with opened(driver, {}, {"y": -0.3}, **SCENE) as (world, (a, b), go):
        assert a.sensors["lidar/front"] == pytest.approx(0.07 - 0.00825, abs=1e-3)
        assert world.published().keys() == {"crate", "rock", "ball"}
        go(1.0, AHEAD, AHEAD)
        crate, ball = world.crate.pose, world.ball.pose
        if driver == "kinematic":
            assert a.state["x"] == pytest.approx(0.07 - 0.02, abs=1e-3)
            assert (crate.x, ball.x) == (0.1, 0.1)
        else:
            assert crate.x > 0.12
            assert crate.x - 0.03 - a.state["x"] == pytest.approx(0.02, abs=0.01)
            assert ball.x > b.state["x"] + 0.02
        assert world.rock.pose.x == -0.2
        assert world.rock.pose.z == pytest.approx(0.05)


@engines
def test_a_ramp_is_driven_up(driver: str) -> None:
    ramp = {"name": "up", "length": 0.4, "height": 0.03, "width": 0.4}
    with opened(driver, {"x": -0.05}, size=[2.0, 1.0], ramps=[ramp]) as (_, (a,), go):
        level = a.shared._engine.poses()[0][0, 2]
        go(1.0, AHEAD)
        assert a.state["x"] > 0.06
        risen = a.shared._engine.poses()[0][0, 2] - level
        assert risen == pytest.approx(0.03 / 0.4 * a.state["x"], abs=1e-3)


@each
def test_a_wall_stops_it(driver: str) -> None:
    with opened(driver, {}, size=[0.5, 0.5]) as (_, (a,), go):
        go(2.5, AHEAD)
        assert a.state["x"] == pytest.approx(0.25 - 0.02, abs=3e-3)
        go(0.5, (-1.0, -1.0))
        assert a.state["x"] < 0.2


@each
def test_without_a_word_it_is_the_definitions_arena(driver: str) -> None:
    with opened(driver, {}, {"y": 0.2}) as (world, (a, _), _):
        assert world.published() == {}
        assert a.sensors["lidar/front"] == pytest.approx(0.4 - 0.00825, abs=1e-3)


@each
def test_one_goes_back_or_all(driver: str) -> None:
    with opened(driver, {}, {"y": -0.3}, **SCENE) as (world, (a, b), go):
        first = numbers(a)
        go(1.0, AHEAD, AHEAD)
        along = b.state["x"]
        a.reset()
        assert (a.state["x"], b.state["x"]) == (0.0, along)
        a.initial = {"x": -0.1, "heading": 1.0}  # for another beginning
        a.reset()
        go(0.05, STILL, STILL)
        assert a.state["x"] == pytest.approx(-0.1, abs=1e-3)
        assert a.state["heading"] == pytest.approx(1.0, abs=1e-2)
        a.initial = {}
        world.reset()
        assert (a.state["x"], b.state["x"]) == (0.0, 0.0)
        assert world.crate.pose.x == pytest.approx(0.1, abs=1e-3)
        assert numbers(a) == pytest.approx(first, abs=1e-3)


@each
def test_what_follows_a_reset_of_all_is_the_same(driver: str) -> None:
    def path(go: Go, robots: list[Any], world: World) -> list[str]:
        seen = []
        for shares in ((AHEAD, (0.5, 1.0)), ((-0.2, 0.9), (1.0, 1.0))):
            go(0.4, *shares)
            seen += [repr(r.state) + repr(r.sensors) for r in robots]
            seen.append(repr(vars(world)["crate"]))
        return seen

    with opened(driver, {}, {"y": -0.3}, **SCENE) as (world, robots, go):
        first = path(go, robots, world)
        world.reset()
        assert path(go, robots, world) == first


@each
def test_nobody_goes_back_to_where_another_is(driver: str) -> None:
    places: list[dict[str, float]] = [{}, {"x": -0.3}, {"y": 0.5}]
    with opened(driver, *places, size=[2.0, 2.0]) as (world, (a, b, c), go):
        go(0.8, AHEAD, STILL, AHEAD)
        go(1.9, STILL, AHEAD, STILL)
        assert hypot(b.state["x"], b.state["y"]) < 0.05
        before = dict(a.state)
        with pytest.raises(AgentError, match=r"robot/a: robot/b is where it starts"):
            a.reset()
        assert dict(a.state) == before
        along = c.state["x"]
        assert along > 0.05
        a.shared.reset([a, b])  # together they may
        assert (a.state["x"], b.state["x"], c.state["x"]) == (0.0, -0.3, along)
        go(0.05, STILL, STILL, STILL)
        assert [r.state["x"] for r in (a, b)] == pytest.approx([0.0, -0.3], abs=1e-3)
        world.reset()
        assert [r.state["x"] for r in (a, b, c)] == [0.0, -0.3, 0.0]


@each
@pytest.mark.parametrize(
    ("place", "what"),
    [
        ({"x": -0.05, "y": 0.04}, r"robot/b starts at x = -0.05 m.*where robot/a is"),
        ({"x": 0.5}, r"robot/b .*where a wall is"),
        ({"x": -0.2, "y": 0.3}, r"robot/b .*where 'rock' is"),
    ],
)
def test_two_in_one_place_are_refused(
    driver: str, place: dict[str, float], what: str
) -> None:
    with (
        pytest.raises(ExperimentError, match=rf"^world 'arena': {what}") as why,
        opened(
            driver, {"y": -0.1, "x": 0.0} if "y" not in place else {}, place, **SCENE
        ),
    ):
        pass
    assert "give robot/b another `initial`, such as { x = " in str(why.value)


@each
def test_robots_of_many_kinds(driver: str) -> None:
    lab = Experiment("kinds", dt=DT, duration="1 s")
    lab.world("arena", options={"size": [40, 40]})
    kinds = ["woodbot", "create2", "epuck", "pioneer3dx", "pioneer3at", "moose"]
    kinds += ["dynabot", "youbot", "youbot_base"]
    for i, kind in enumerate(kinds):
        lab.robot(kind, kind, driver, world="arena", initial={"y": 4.0 * i - 16})
    agents: dict[str, Any] = dict(lab.check())
    robots = [agents[f"robot/{kind}"] for kind in kinds]
    try:
        for robot in robots:
            robot.open()
        for robot in robots:
            rows = robot.command.schema.rows()
            ahead = {p: 0.2 * f.range[1] for p, f in rows if p in FORWARD}
            assert ahead
            robot.command = ahead
        for _ in range(20):
            robots[0].shared.advance(DT)
        for robot in robots:
            robot.sense()
            assert robot.state["x"] > 0.01, robot.key
    finally:
        for robot in robots:
            robot.close()

"""Joints in both engines, by the same tests: arms, slides, stops, loops, rollers."""

from math import hypot, pi, sqrt
from typing import Any, ClassVar

import numpy as np
import pytest

from rems_net.agents.ports import In, Out
from rems_net.agents.robot import Definition, Driver, combine
from rems_net.bodies.body import (
    Body,
    Box,
    Cylinder,
    Encoder,
    Hinge,
    Loop,
    Part,
    Servo,
    Slide,
    Sphere,
    Tachometer,
)
from rems_net.defdict import Schema, angle, angular_velocity, length, ratio
from rems_net.errors import SchemaError
from rems_net.scenes.scene import Scene
from tests.drivers.physics.test_physics import ENGINES
from tests.robots.moving import gap, obey, running

pytestmark = pytest.mark.parametrize("engine", ENGINES)
Engine = type[Driver]
UP, LEFT = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)
BASE = (Part(Box((0.1, 0.1, 0.1)), 1.0, friction=None),)
TURN = Servo(gain=20.0, speed=1.5, share="share")
REACH = Servo(gain=20.0, speed=0.1, share="share")


def rod(size: float, mass: float) -> tuple[Part, ...]:
    """A rod that stands on its joint."""
    return (Part(Cylinder(0.01, size), mass, (0.0, 0.0, size / 2), friction=None),)


class Arm(Definition):
    """On a table: two hinges that carry each other, and a tool that slides out."""

    command = In(
        Schema(
            "arm.command",
            {
                "shoulder": angle(range=(-2, 2)),
                "elbow": angle(range=(-2, 2)),
                "tool": length(range=(0, 0.1)),
                "share": ratio(range=(0, 1)),
            },
        )
    )
    state = Out(
        Schema("arm.state", {"shoulder": angle(), "elbow": angle(), "tool": length()})
    )
    sensors = Out(
        Schema("arm.sensors", {"elbow": {"at": angle(), "speed": angular_velocity()}})
    )

    def body(self) -> Body:
        tool = Slide(
            "tool",
            rod(0.05, 0.05),
            (0, 0, 0.2),
            UP,
            force=20.0,
            droop=0.01,
            servo=REACH,
            limits=(0.0, 0.1),
            position="tool",
        )
        elbow = Hinge(
            "elbow",
            rod(0.2, 0.2),
            (0, 0, 0.3),
            LEFT,
            torque=5.0,
            droop=0.05,
            armature=0.01,
            servo=TURN,
            position="elbow",
            joints=(tool,),
        )
        shoulder = Hinge(
            "shoulder",
            rod(0.3, 0.5),
            (0, 0, 0.05),
            LEFT,
            torque=10.0,
            droop=0.05,
            armature=0.01,
            servo=TURN,
            position="shoulder",
            joints=(elbow,),
        )
        sensors = Encoder("elbow/at", "elbow"), Tachometer("elbow/speed", "elbow")
        return Body(BASE, (shoulder,), sensors, height=1.0, fixed=True)


def test_an_arm_goes_where_it_is_told_at_the_speed_it_is_told(engine: Engine) -> None:
    told = {"shoulder": 0.8, "elbow": -1.2, "tool": 0.05}
    most = {"shoulder": 0.75, "elbow": 0.75, "tool": 0.05}
    with running(Arm, engine) as robot:
        for n in range(1, 101):
            obey(robot, {**told, "share": 0.5}, 0.02)
            for joint, speed in most.items():
                gone = min(0.02 * n * speed, abs(told[joint]))
                off = abs(robot.state[joint]) - gone
                assert abs(off) < 0.02 * speed, (n, joint)
            assert robot.sensors["elbow/at"] == robot.state["elbow"]
            if n == 40:
                assert robot.sensors["elbow/speed"] == pytest.approx(-0.75, rel=0.01)
        assert dict(robot.state) == pytest.approx(told, abs=2e-3)
        assert robot.sensors["elbow/speed"] == pytest.approx(0.0, abs=1e-3)


def test_an_arm_that_is_told_nothing_holds_where_it_started(engine: Engine) -> None:
    initial = {"shoulder": 1.0, "elbow": -0.5, "tool": 0.02}
    with running(Arm, engine, initial=initial) as robot:
        assert dict(robot.state) == initial
        assert robot.sensors["elbow/at"] == -0.5
        for _ in range(50):
            obey(robot, {}, 0.02)
        assert dict(robot.state) == pytest.approx(initial, abs=2e-3)


def test_units_of_joints_are_checked(engine: Engine) -> None:
    class Confused(Arm):
        command = In(
            Schema(
                "arm.command",
                {
                    "shoulder": angular_velocity(),
                    "elbow": angle(),
                    "tool": length(),
                    "share": ratio(),
                },
            )
        )

    with pytest.raises(SchemaError, match=r"command 'shoulder' in 'rad'.*'rad/s'"):
        combine(Confused, engine)("c").prepare()


def test_arms_on_tables_stand_where_they_are_put(engine: Engine) -> None:
    class Placed(Arm):
        pose: ClassVar = {"x": length(), "y": length(), "heading": angle()}
        joints: ClassVar = {"shoulder": angle(), "elbow": angle(), "tool": length()}
        state = Out(Schema("placed.state", {**pose, **joints}))

    places = {"x": 1.0, "y": 0.5, "heading": pi / 2}, {"x": -1.0}
    robots: list[Any] = [
        combine(Placed, engine)(f"r{n}", initial=place)
        for n, place in enumerate(places)
    ]
    for robot in robots:
        robot.prepare()
    world = type(robots[0]).share(robots, Scene())
    world.open()
    for robot in robots:
        robot.command = {"shoulder": 0.5, "share": 1.0}
    for _ in range(20):
        world.advance(0.05)
        for robot in robots:
            robot.sense()
    (first, second), (turn, _) = world._engine.poses()
    assert first == pytest.approx((1.0, 0.5, 1.0), abs=1e-9)
    assert turn[:, 0] == pytest.approx((0.0, 1.0, 0.0), abs=1e-9)
    assert second == pytest.approx((-1.0, 0.0, 1.0), abs=1e-9)
    for robot in robots:
        assert robot.state["shoulder"] == pytest.approx(0.5, abs=2e-3)
        assert robot.state["x"] in (1.0, -1.0)
    world.close()


class Pendulum(Definition):
    """A rod that hangs freely; nobody tells it anything."""

    command = In(Schema("pendulum.command", {}))
    state = Out(Schema("pendulum.state", {"swing": angle()}))
    limits: tuple[float, float] | None = None

    def body(self) -> Body:
        hanging = Part(Cylinder(0.01, 0.5), 0.3, (0.0, 0.0, -0.25), friction=None)
        joint = Hinge(
            "swing", (hanging,), (0, 0, 0), LEFT, limits=self.limits, position="swing"
        )
        return Body(BASE, (joint,), height=1.0, fixed=True)


def test_a_free_joint_swings_in_its_period(engine: Engine) -> None:
    # Of a rod about its end; what its thickness adds is in the fifth digit.
    period = 2 * pi * sqrt(2 * 0.5 / 3 / 9.81)
    with running(Pendulum, engine, initial={"swing": 0.1}) as robot:
        seen = []
        for _ in range(round(5 * period / 0.01)):
            obey(robot, {}, 0.01)
            seen.append(robot.state["swing"])
    signs = np.sign(seen)
    crossings = np.flatnonzero(signs[1:] != signs[:-1])
    half = np.diff(crossings).mean() * 0.01
    assert 2 * half == pytest.approx(period, rel=0.02)
    assert max(seen[-200:]) == pytest.approx(0.1, rel=0.05)


def test_a_stop_holds_a_joint(engine: Engine) -> None:
    class Stopped(Pendulum):
        limits = (-0.2, 2.0)

    with running(Stopped, engine, initial={"swing": 0.8}) as robot:
        lowest = 1.0
        for _ in range(100):
            obey(robot, {}, 0.01)
            lowest = min(lowest, robot.state["swing"])
    assert -0.25 < lowest < -0.15


class Blocked(Definition):
    """A rod that is told to go further than its stop lets it."""

    command = In(Schema("blocked.command", {"rod": angle(range=(-2, 2))}))
    state = Out(Schema("blocked.state", {"rod": angle()}))

    def body(self) -> Body:
        joint = Hinge(
            "rod",
            rod(0.2, 0.2),
            (0, 0, 0),
            LEFT,
            torque=1.0,
            droop=0.1,
            armature=0.01,
            servo=Servo(gain=20.0, speed=1.0),
            limits=(-0.2, 0.2),
            position="rod",
        )
        return Body(BASE, (joint,), height=1.0, fixed=True)


def test_a_servo_that_was_held_up_comes_back_at_once(engine: Engine) -> None:
    with running(Blocked, engine) as robot:
        for _ in range(40):
            obey(robot, {"rod": 2.0}, 0.05)
        assert robot.state["rod"] == pytest.approx(0.2, abs=0.02)
        for _ in range(12):
            obey(robot, {"rod": 0.0}, 0.05)
        assert robot.state["rod"] == pytest.approx(0.0, abs=0.01)


class FourBar(Definition):
    """A parallelogram: a crank that is driven, a coupler, and a crank that follows."""

    command = In(Schema("four.command", {"driven": angle(range=(-2, 2))}))
    state = Out(Schema("four.state", {"driven": angle(), "follower": angle()}))

    def body(self) -> Body:
        coupler = Part(Cylinder(0.01, 0.1, (1, 0, 0)), 0.05, (0.05, 0, 0), None)
        knee = Hinge("knee", (coupler,), (0, 0, 0.1), LEFT)
        driven = Hinge(
            "driven",
            rod(0.1, 0.1),
            (0, 0, 0),
            LEFT,
            torque=2.0,
            droop=0.05,
            armature=0.001,
            servo=Servo(gain=20.0, speed=1.5),
            position="driven",
            joints=(knee,),
        )
        follower = Hinge(
            "follower", rod(0.1, 0.1), (0.1, 0, 0), LEFT, position="follower"
        )
        loop = Loop("knee", "follower", (0.1, 0.0, 0.1))
        return Body(BASE, (driven, follower), height=1.0, fixed=True, loops=(loop,))


def test_a_loop_stays_closed_while_it_moves(engine: Engine) -> None:
    initial = {"driven": 0.4, "follower": 0.4}
    with running(FourBar, engine, initial=initial) as robot:
        assert gap(robot) < 1e-6
        for told in (0.9, -0.9):
            widest = 0.0
            for _ in range(75):
                obey(robot, {"driven": told}, 0.02)
                widest = max(widest, gap(robot))
            assert widest < 1e-3
            assert robot.state["driven"] == pytest.approx(told, abs=5e-3)
            assert robot.state["follower"] == pytest.approx(told, abs=1e-2)


RADIUS, AHEAD, ASIDE = 0.05, 0.228, 0.158
ROOT = sqrt(0.5)


SPEED = angular_velocity(range=(-20, 20))
FOUR = [f"{end}/{side}" for end in ("front", "rear") for side in ("left", "right")]


def speeds(x: float, y: float, turn: float) -> dict[str, float]:
    """What four mecanum wheels are told, so that their base goes like this."""
    about = (AHEAD + ASIDE) * turn
    each = (x - y - about, x + y + about, x + y - about, x - y + about)
    return {name: one / RADIUS for name, one in zip(FOUR, each, strict=True)}


class Mecanum(Definition):
    """Four wheels with rollers under a box."""

    command = In(Schema("mecanum.command", dict.fromkeys(FOUR, SPEED)))
    state = Out(Schema("m.state", {"x": length(), "y": length(), "heading": angle()}))
    sensors = Out(Schema("m.sensors", {"odometer": angle()}))

    def body(self) -> Body:
        def wheel(name: str, x: float, y: float, side: float) -> Hinge:
            tyre = Part(Cylinder(RADIUS, 0.05, LEFT), 0.4, friction=0.8)
            return Hinge(
                name,
                (tyre,),
                (x, y, 0),
                LEFT,
                torque=2.0,
                droop=0.2,
                armature=1e-3,
                rollers=(ROOT, side * ROOT, 0.0),
            )

        wheels = (
            wheel("front/right", AHEAD, -ASIDE, 1),
            wheel("front/left", AHEAD, ASIDE, -1),
            wheel("rear/right", -AHEAD, -ASIDE, -1),
            wheel("rear/left", -AHEAD, ASIDE, 1),
        )
        box = Part(Box((0.57, 0.36, 0.1)), 20.0, (0, 0, 0.04), friction=0.5)
        sensors = (Encoder("odometer", "front/left"),)
        return Body((box,), wheels, sensors, height=RADIUS)


@pytest.mark.parametrize(
    "told",
    [(0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (-0.2, 0.2, 0.0), (0.0, 0.0, 1.0), (0.3, 0, 1)],
    ids=["ahead", "aside", "diagonal", "round", "curve"],
)
@pytest.mark.parametrize("heading", [0.0, 0.5])
def test_rollers_drive_as_the_kinematics_say(
    engine: Engine, told: tuple[float, float, float], heading: float
) -> None:
    ahead, aside, turn = told
    command = speeds(*told)
    with running(Mecanum, engine, initial={"heading": heading}) as robot:
        for _ in range(10):
            obey(robot, command, 0.05)
        before = dict(robot.state)
        for _ in range(20):
            obey(robot, command, 0.05)
        moved = {path: robot.state[path] - before[path] for path in before}
        rolled = 1.5 * command["front/left"]
        assert robot.sensors["odometer"] == pytest.approx(rolled, abs=0.3)
    assert moved["heading"] == pytest.approx(turn, rel=0.01, abs=5e-3)
    # The chord of the arc that it drives in one second, at the heading in its middle.
    middle = before["heading"] + turn / 2
    chord = 1.0 if turn == 0 else np.sin(turn / 2) / (turn / 2)
    x, y = chord * ahead, chord * aside
    s, c = np.sin(middle), np.cos(middle)
    off = hypot(moved["x"] - (c * x - s * y), moved["y"] - (s * x + c * y))
    assert off < 0.01 * hypot(x, y) + 2e-3


def test_a_ball_under_a_body_that_is_fixed_falls_for_itself(engine: Engine) -> None:
    class Bolted(Pendulum):
        def body(self) -> Body:
            ball = Part(Sphere(0.02), 0.1, (0.0, 0.0, -0.3), friction=None)
            joint = Slide("swing", (ball,), (0, 0, 0), UP, position="swing")
            return Body(BASE, (joint,), height=2.0, fixed=True)

        state = Out(Schema("bolted.state", {"swing": length()}))

    with running(Bolted, engine) as robot:
        for _ in range(20):
            obey(robot, {}, 0.01)
        assert robot.state["swing"] == pytest.approx(-9.81 * 0.2**2 / 2, rel=0.02)

"""A robot of the user's own file does what every robot does, in both engines."""

from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.robot import Definition, Driver, Robot
from rems_net.bodies import Driven, Model
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.testing import check_robot
from tests.bodies.files.robots import CART, LIMB, Cart, Limb, arm, made, written
from tests.drivers.physics.test_physics import bits, needs
from tests.robots.moving import obey, running

Engine = type[Driver]
DT = 0.05
SLIPS = {"caster": 0.0}


def limb(folder: Path, kind: str) -> type[Definition]:
    if kind == "urdf":
        return made(Limb, arm(folder))
    return made(Limb, written(folder, "limb.xml", LIMB))


@pytest.mark.parametrize(
    ("engine", "kind"),
    [
        pytest.param(Mujoco, "urdf", marks=needs("mujoco")),
        pytest.param(Mujoco, "mjcf", marks=needs("mujoco")),
        pytest.param(Pybullet, "urdf", marks=needs("pybullet")),
    ],
)
def test_it_is_a_robot(engine: Engine, kind: str, tmp_path: Path) -> None:
    """It opens, moves as its mathematics says, resets to the bit, stops, refuses."""
    check_robot(limb(tmp_path, kind), engine, alone=True)


@pytest.mark.parametrize(
    "driver",
    [
        "kinematic",
        pytest.param("mujoco", marks=needs("mujoco")),
        pytest.param("pybullet", marks=needs("pybullet")),
    ],
)
def test_several_share_a_world(driver: str, tmp_path: Path) -> None:
    """Two carts of one file, and a Woodbot: they see each other, bump, and go back."""
    cart = made(Cart, written(tmp_path, "cart.urdf", CART))
    lab = Experiment("shared", dt=DT, duration="1 s", folder=tmp_path)
    lab.world("hall", options={"balls": [{"name": "ball", "x": -0.4, "mass": "20 g"}]})
    for name, place in (("a", {}), ("b", {"x": 0.5, "heading": "180 deg"})):
        lab.robot(name, cart, driver, world="hall", initial=place)
    lab.robot("c", "woodbot", driver, world="hall", initial={"y": 0.4})
    agents: dict[str, Any] = dict(lab.check())
    robots = [agents[f"robot/{name}"] for name in "abc"]
    a, b, _ = robots

    def drive(seconds: float) -> list[bytes]:
        for robot in (a, b):
            robot.command = {"left": 6.0, "right": 6.0}
        path = []
        for _ in range(round(seconds / DT)):
            a.shared.advance(DT)
            for robot in robots:
                robot.sense()
            path.append(b"".join(map(bits, robots)))
        return path

    try:
        for robot in robots:
            robot.open()
            robot.sense()
        # From the middle of one to the front of the other.
        assert a.sensors["ahead"] == pytest.approx(0.42, abs=0.002)
        first = drive(1.5)
        assert 0.15 < b.state["x"] - a.state["x"] < 0.18
        assert abs(a.state["x"]) > 0.05
        a.shared.reset(robots)
        assert drive(1.5) == first
    finally:
        for robot in robots:
            robot.close()


@pytest.mark.parametrize(
    "engine",
    [
        pytest.param(Mujoco, marks=needs("mujoco")),
        pytest.param(Pybullet, marks=needs("pybullet")),
    ],
)
def test_a_cart_drives(engine: Engine, tmp_path: Path) -> None:
    """As far as its wheels turn, on the floor, and again to the last bit.

    `check_robot` of it takes too long to be done here, and finds nothing else.
    """

    def go(robot: Robot) -> list[bytes]:
        path = []
        for _ in range(20):
            obey(robot, {"left": 5.0, "right": 5.0}, DT)
            path.append(bits(robot))
        return path

    with running(made(Cart, written(tmp_path, "cart.urdf", CART)), engine) as robot:
        first = go(robot)
        # They slip at first: a step from 0 to 5 rad/s.
        assert robot.state["x"] == pytest.approx(0.19, abs=0.01)
        assert robot.state["y"] == pytest.approx(0.0, abs=0.01)
        robot.reset()
        assert go(robot) == first


class Drafted(Cart):
    """The cart with the motors of a draft."""

    def body(self) -> Model:
        more: dict[str, Any] = {"droop": 2.0, "armature": 0.0005}
        wheels = (Driven("left", **more), Driven("right", **more))
        return Model(self.file, wheels, super().body().sensors, friction=SLIPS)


@needs("mujoco")
@needs("pybullet")
def test_engines_differ_only_where_wheels_slip(tmp_path: Path) -> None:
    """A jump of the speed makes wheels slip, in each engine otherwise; a ramp does not.

    The wheels slip as they start and stop.
    """
    kind = made(Drafted, written(tmp_path, "cart.urdf", CART))

    def gone(engine: Engine, ramp: float) -> list[float]:
        """How far it goes until 0.5 s, and in the next second, m."""
        with running(kind, engine) as robot:
            places = []
            for n in range(1, 76):
                speed = 6.25 * min(1.0, n * 0.02 / ramp if ramp else 1.0)
                obey(robot, {"left": speed, "right": speed}, 0.02)
                places.append(float(robot.state["x"]))
        return [places[24], places[-1] - places[24]]

    for engine in (Mujoco, Pybullet):
        start, on = gone(engine, 0.0)
        assert 0.1 < start < 0.12  # of 0.125 m
        assert on == pytest.approx(0.25, abs=5e-4)
        # 1.5 s at 0.25 m/s, less what is missing in the ramp
        assert sum(gone(engine, 0.5)) == pytest.approx(0.315, abs=1e-3)

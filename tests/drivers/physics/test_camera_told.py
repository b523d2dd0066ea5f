"""What is told of cameras that cannot be, and where nothing draws."""

import sys
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from rems_net.agents.ports import Out
from rems_net.agents.robot import combine
from rems_net.bodies.body import Camera
from rems_net.defdict import Schema, array
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.errors import SchemaError
from tests.commands import environment, finished
from tests.drivers.physics.eyes import Engine, Eye, why_not
from tests.drivers.physics.test_physics import ENGINES
from tests.robots.moving import running


def test_another_thread_is_told() -> None:
    """Of MuJoCo, which draws by OpenGL; Bullet draws anywhere."""
    if why := why_not(Mujoco):
        pytest.skip(why)
    with running(Eye, Mujoco) as robot, ThreadPoolExecutor(1) as other:
        failed = other.submit(robot.sense).exception()
    assert "the thread that opened it" in str(failed)


def test_where_nothing_draws_it_is_told_before_anything_starts() -> None:
    """In a process of its own, since MuJoCo chooses as it is loaded."""
    pytest.importorskip("mujoco", reason="mujoco is not installed.")
    script = (
        "from rems_net import Experiment\n"
        "lab = Experiment('blind', dt=0.1, duration=1)\n"
        "lab.robot('bot', 'epuck_camera', 'mujoco')\n"
        "lab.check()\n"
    )
    done = finished(
        [sys.executable, "-c", script], env=environment(MUJOCO_GL="disabled")
    )
    assert "A camera needs a renderer" in done.stderr
    assert "MUJOCO_GL is 'disabled'; try without it" in done.stderr
    assert "the driver pybullet" in done.stderr


@pytest.mark.parametrize("engine", ENGINES)
def test_a_field_that_holds_no_picture_is_refused(engine: Engine) -> None:
    class Narrow(Eye):
        sensors = Out(Schema("narrow", {"seen": array((24, 31, 3), dtype="u1")}))

    with pytest.raises(SchemaError, match=r'"seen": array\(\(24, 32, 3\), dtype="u1"'):
        combine(Narrow, engine)("r").prepare()


@pytest.mark.parametrize(
    ("about", "problem"),
    [
        ({"width": 0}, "1 pixel or more"),
        ({"field_of_view": 60.0}, "radians"),
        ({"direction": (1.0, 1.0, 0.0)}, "length 1"),
    ],
)
def test_a_camera_that_cannot_be(about: dict[str, Any], problem: str) -> None:
    good: dict[str, Any] = {"width": 4, "height": 3, "field_of_view": 1.0}
    good |= {"direction": (1.0, 0.0, 0.0)}
    with pytest.raises(SchemaError, match=problem):
        Camera("seen", (0.0, 0.0, 0.0), **{**good, **about})

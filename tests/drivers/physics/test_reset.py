"""A reset puts a world back without building it, and what follows is the same."""

from typing import Any

import numpy as np
import pytest

from rems_net.agents.robot import Robot
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.physics import Physics
from rems_net.drivers.physics.pybullet import Pybullet
from tests.drivers.physics.test_physics import ENGINES, Engine, bits, needs
from tests.robots.figures import drive, woodbot


def path(robot: Robot) -> list[bytes]:
    """What it goes through, from where it is: driving, turning, and into the wall."""
    seen = [bits(robot)]
    for left, right, duration in ((1, 0.4, 0.5), (-0.7, 0.9, 0.3), (1, 1, 0.4)):
        drive(robot, left, right, duration)
        seen.append(bits(robot))
    return seen


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    "before",
    [((1, 1, 2.5),), ((-1, 0.2, 0.5), (1, -1, 0.3))],
    ids=["at the wall", "turning"],
)
def test_what_follows_is_the_same_to_the_last_bit(
    engine: Engine, before: tuple[tuple[float, float, float], ...]
) -> None:
    """As in a world that was just built, whatever it went through before."""
    initial = {"x": 0.15, "y": -0.05, "heading": 0.1}
    with woodbot(engine, initial=initial) as robot:
        first = path(robot)
        robot.reset()
        for one in before:
            drive(robot, *one)
        robot.reset()
        assert path(robot) == first
    with woodbot(engine, initial=initial) as robot:
        assert path(robot) == first
    assert len(set(first)) == len(first)


@pytest.mark.parametrize("engine", ENGINES)
def test_nothing_is_built(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    built = []
    build = engine.build  # type: ignore[attr-defined]

    def counted(self: Physics, *given: Any) -> Any:
        built.append(self)
        return build(self, *given)

    monkeypatch.setattr(engine, "build", counted)
    with woodbot(engine) as robot:
        for _ in range(5):
            drive(robot, 1, 0.5)
            robot.reset()
        assert len(built) == 1
        robot.reset(initial={"x": 0.1})  # nor for another beginning
        assert len(built) == 1
        assert robot.state["x"] == 0.1
        drive(robot, 0, 0)
        assert robot.state["x"] == pytest.approx(0.1, abs=1e-4)


@pytest.mark.parametrize("engine", [pytest.param(Mujoco, marks=needs("mujoco"))])
def test_all_of_mujocos_state_comes_back(engine: Engine) -> None:
    """Integrator, warm start, contacts: every array of MjData after the next step."""
    with woodbot(engine) as robot:
        data = robot.member.instance._data  # type: ignore[attr-defined]
        world: Any = robot._world

        def step() -> dict[str, bytes]:
            world._engine.advance(0.001, 1)
            # Never written: the places of entries in a sparse matrix; this is none.
            names = [n for n in dir(data) if not n.startswith(("_", "efc_J_"))]
            arrays = {n: getattr(data, n) for n in names}
            found = {
                name: array.tobytes()
                for name, array in arrays.items()
                if isinstance(array, np.ndarray) and array.dtype.kind in "fiu"
            }
            found["contacts"] = b"".join(
                np.concatenate([c.pos, c.frame, [c.dist]]).tobytes()
                for c in data.contact
            )
            return found

        robot.reset()
        first = step()
        drive(robot, 1, 0.2, 0.5)
        robot.reset()
        again = step()
        differing = [name for name in first if first[name] != again[name]]
        assert not differing
        assert {"qpos", "qvel", "qacc_warmstart", "efc_force"} <= first.keys()
        assert first["contacts"]


@pytest.mark.parametrize("engine", [pytest.param(Pybullet, marks=needs("pybullet"))])
def test_all_that_bullet_tells_comes_back(engine: Engine) -> None:
    """Bodies, joints with their motors' torques, and contacts with their forces."""
    with woodbot(engine) as robot:
        instance = robot.member.instance  # type: ignore[attr-defined]
        world: Any = robot._world

        def step() -> list[Any]:
            world._engine.command([[0.0, 0.0]])  # as before every block of steps
            world._engine.advance(0.001, 1)
            body = instance._robot
            return [
                instance._call("getContactPoints"),
                instance._call("getBasePositionAndOrientation", body),
                instance._call("getBaseVelocity", body),
                instance._call("getJointStates", body, instance._joints),
            ]

        robot.reset()
        first = step()
        drive(robot, 1, 0.2, 0.5)
        robot.reset()
        assert step() == first
        assert first[0]

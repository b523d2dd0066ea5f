"""All robots of a world sense at once, and each reads what is its own."""

from collections.abc import Iterable
from typing import Any

import pytest

from rems_net import Experiment
from tests.drivers.physics.test_physics import needs

#: by name: of all kinds, with sensors of all kinds; the first one is bolted down
ROBOTS = {
    "a": ("youbot_arm", {"x": 0.0, "y": 1.5, "arm/joint/1": 2.0}),
    "b": ("create2", {"x": -2.0, "heading": 0.4}),
    "c": ("epuck", {"x": 0.0, "y": -1.0, "heading": -1.0}),
    "d": ("woodbot", {"x": 1.5, "heading": 2.0}),
}
#: what some of their rays meet
BOXES = [{"name": "y", "x": 0.09, "y": -1.1}, {"name": "z", "x": 1.3, "y": 0.45}]


def opened(engine: str, names: Iterable[str]) -> list[Any]:
    """These robots in one world, each where it belongs."""
    lab = Experiment("sensing", dt=0.1, duration="1 s")
    lab.world("hall", options={"size": [6.0, 6.0], "boxes": BOXES})
    for name in names:
        kind, place = ROBOTS[name]
        lab.robot(name, kind, engine, world="hall", initial=place)
    agents: dict[str, Any] = dict(lab.check())
    robots = [agents[f"robot/{name}"] for name in names]
    for robot in robots:
        robot.open()
    return robots


@pytest.mark.parametrize(
    "engine", [pytest.param(name, marks=needs(name)) for name in ("mujoco", "pybullet")]
)
def test_each_reads_what_it_reads_alone(engine: str) -> None:
    together = opened(engine, ROBOTS)
    for robot in together:
        (alone,) = opened(engine, [robot.name])
        for _ in range(2):
            robot.sense()
            alone.sense()
            for port in ("state", "sensors"):
                if port in alone.__dict__:
                    found = getattr(robot, port).flat()
                    assert found == pytest.approx(getattr(alone, port).flat(), abs=1e-3)
            robot.reset()
        alone.close()
    _, _, epuck, woodbot = together
    assert woodbot.sensors["lidar/front"] < 1.0
    assert any(epuck.sensors[f"proximity/{n}"] < 0.05 for n in range(8))
    woodbot.command = {"wheel/left": -3.0, "wheel/right": 3.0}
    woodbot.shared.advance(0.1)
    for robot in together:
        robot.sense()
    assert woodbot.sensors["gyro/z"] > 0.5
    assert epuck.sensors["gyro/z"] == pytest.approx(0.0, abs=1e-2)
    woodbot.shared.close()

"""The Woodbot as a process joins an open fabric, and is a robot like any other."""

import math
import time
from contextlib import suppress

import pytest

import rems_net
from rems_net.client.fabric import Fabric
from rems_net.errors import FabricError
from tests.firmware.posix.scene import NAME, Scene
from tests.reliability.rig.programs import until


def here(fabric: Fabric, name: str = NAME) -> bool:
    """Whether it is listed; a clock that has just started may not answer yet."""
    with suppress(FabricError):
        return any(one["agent"] == f"robot/{name}" for one in fabric.agents())
    return False


def test_it_is_listed_and_driven_with_units_and_stopped(scene: Scene) -> None:
    scene.serve()
    robot = scene.start("--do", "servo left dead 0", "--do", "servo right dead 0")
    with rems_net.join(at=scene.endpoint) as fabric:
        until(lambda: here(fabric), "the robot", 60.0)
        listed = scene.rig.rems("list", router=scene.endpoint)
        assert listed.process.wait() == 0
        assert f"robot/{NAME}" in listed.text()
        bot = fabric.robot(NAME)
        begun = time.monotonic()
        while bot.state.x < 0.02:  # it stops by itself if nobody says it again
            bot.command.wheel.update({"left": "0.5 rev/s", "right": "0.5 rev/s"})
            assert time.monotonic() < begun + 30.0
        moving = [one for one in robot.pulses() if not one.stands]
        off = round(500 * math.pi / 7.3)
        assert (moving[-1].left, moving[-1].right) == (1500 + off, 1500 - off)
        # What it says of itself is where it is, but for the time of the question.
        x, y, _ = map(float, robot.control("pose").split()[1:])
        assert 0.01 < x < 0.2
        assert abs(y) < 0.005
        at = time.monotonic()
        receipts = fabric.stop()
        assert [one.robot for one in receipts] == [f"robot/{NAME}"]
        assert receipts[0].stands
        assert robot.stood(at) - at < 0.6
        bot.command.wheel.left = "0.5 rev/s"
        held = len(robot.pulses())
        until(lambda: bot.state.x is not None, "an answer", 20.0)
        assert len(robot.pulses()) == held, "STOP holds"
        fabric.release()

        def obeys() -> bool:
            bot.command.wheel.left = "0.5 rev/s"
            return len(robot.pulses()) > held

        until(obeys, "it obeys after the release", 20.0)


def test_it_echoes_the_tick_of_the_command_it_obeys(scene: Scene) -> None:
    scene.serve()
    scene.start()
    driver = scene.drive()
    echoed = until(
        lambda: [stamp for stamp in driver.obeyed if len(stamp) == 4], "an echo"
    )
    n, _, _, said = echoed[-1]
    assert 0 < said <= n < said + 25, "it obeys what was said in the last 0.5 s"


@pytest.mark.parametrize("fault", ["absent", "wrong", "nan", "old"])
def test_a_sensor_that_fails_stops_nothing(scene: Scene, fault: str) -> None:
    scene.serve()
    parts = ("front", "right", "gyro", "compass")
    words = [w for part in parts for w in ("--do", f"part {part} {fault}")]
    scene.start(*words)
    scene.drive()
    with rems_net.join(at=scene.endpoint) as fabric:
        sensors = fabric.robot(NAME).sensors
        assert math.isfinite(sensors.lidar.front)

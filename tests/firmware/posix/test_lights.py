"""What a Woodbot's lights show, from a refused password until STOP."""

import re

import pytest

import rems_net
from rems_net.client import Proxy
from tests.firmware.compiling import CORE
from tests.firmware.posix.faults import TIMEOUT
from tests.firmware.posix.robot import Robot
from tests.firmware.posix.scene import Scene
from tests.reliability.rig.programs import until

DARK = "000000"


def colours() -> dict[str, str]:
    """The table of robot/leds.c, as control says it: {"STOPPED": "320000"}."""
    code = (CORE / "robot" / "leds.c").read_text(encoding="utf-8")
    told = re.findall(r"SHOWS\(LIGHTS_(\w+), (\d+), (\d+), (\d+)", code)
    return {name: bytes(map(int, light)).hex() for name, *light in told}


def lights(robot: Robot) -> list[str]:
    return robot.control("lights").split()[1:]


def shows(robot: Robot, name: str, flashing: bool = False) -> None:
    until(lambda: lights(robot)[0] == colours()[name], name, TIMEOUT)
    if flashing:
        until(lambda: lights(robot)[0] == DARK, f"{name}, dark", TIMEOUT)
        until(lambda: lights(robot)[0] == colours()[name], name, TIMEOUT)


def blinks(proxy: Proxy, robot: Robot) -> bool:
    """Whether all of them are seen lit; for 3 s after each call they flash."""
    proxy.blink()
    return any(DARK not in lights(robot) for _ in range(10))


@pytest.mark.timeout(300)
def test_lights(scene: Scene) -> None:
    words = ["--do", "air LAB other", "--set", "ssid=LAB", "--set", "password=secret"]
    robot = scene.start(*words)
    shows(robot, "NO_NETWORK", flashing=True)
    assert lights(robot)[1:] == [DARK] * 5
    robot.control("air LAB secret")
    shows(robot, "NO_ROUTER")
    scene.serve()
    shows(robot, "STANDS")
    robot.control("part compass absent")
    until(lambda: lights(robot)[2:] == [DARK, DARK, "140000", DARK], "red", TIMEOUT)
    robot.control("part compass good")
    until(lambda: lights(robot)[2:] == [DARK] * 4, "no red", TIMEOUT)
    scene.drive()
    shows(robot, "DRIVEN")
    with rems_net.join(at=scene.endpoint) as fabric:
        fabric.stop()
        shows(robot, "STOPPED")
        fabric.release()
        shows(robot, "DRIVEN")
        until(lambda: blinks(fabric.robot(robot.name), robot), "all", TIMEOUT)


def test_a_robot_without_settings_flashes_white(scene: Scene) -> None:
    shows(scene.start("--do", "air LAB other"), "NEW", flashing=True)

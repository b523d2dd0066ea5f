"""A device that is silent, and calls that never return."""

import re
import time
from pathlib import Path

import pytest

from rems_net.agents.robot import combine
from rems_net.errors import AgentError
from tests.agents.runs import until
from tests.drivers.hardware.cart import Device, drive, opened
from tests.drivers.hardware.parts import BareCart, Cart, SerialCart
from tests.drivers.hardware.test_driven import BUSY, device_threads, keep


def test_a_silent_device_is_connected_anew(tmp_path: Path) -> None:
    with Device(tmp_path) as device, opened(device) as robot:
        robot.max_age, robot.silence = 0.3, 0.6
        keep(robot, lambda: device.speed == 0.5)
        begun = device.tell("hang 1.2")
        keep(robot, lambda: "does not answer" in robot.figures()["safe"])
        keep(robot, lambda: not robot.figures()["connected"])
        until(lambda: robot.figures()["reconnects"] > 0)
        # What waited in the device's own buffer ends with standing still, and so it
        # goes on: no command of before comes after that.
        speeds = [n["heard"][0] for n in device.heard(begun + 0.1)]
        assert 0.0 in speeds
        assert not any(speeds[speeds.index(0.0) :]), speeds
        keep(robot, lambda: device.speed == 0.5)


@pytest.mark.parametrize(("padding", "place"), [(0, "read"), (30_000, "write")])
def test_a_call_that_hangs(
    tmp_path: Path, padding: int, place: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """Neither the host nor the end waits for it."""
    with Device(tmp_path) as device:
        with opened(device, BareCart, padding=padding) as robot:
            keep(robot, lambda: device.speed == 0.5)
            begun = device.tell("hang 1.2")
            while time.monotonic() < begun + 0.9:
                drive(robot, 0.1)
            told = [n for n in device.heard(begun) if n["heard"][0]]
            keep(robot, lambda: robot.figures()["reconnects"] > 0)
            heard = [n["heard"] for n in device.heard(begun)][len(told) :]
            # What hung in the line comes through; after it a standstill, first.
            assert [0.0, 0.0] in heard[:2]
            keep(robot, lambda: device.speed == 0.5)
        assert device.speed == 0.0
    warned = capfd.readouterr().err
    assert re.search(
        r"robot/b receives nothing: exchange\(\) hangs for 0\.\d s \(parts\.py, line "
        r"\d+, in exchange\)\n",
        warned,
    ), warned
    assert warned.count("receives nothing") == 1


def test_close_while_a_call_hangs(tmp_path: Path) -> None:
    with Device(tmp_path) as device:
        robot = combine(Cart, BareCart)("b", options={"port": str(device.link)})
        robot.prepare()
        robot.open()
        keep(robot, lambda: device.speed == 0.5)
        device.tell("hang 2.5")
        drive(robot, 0.1)
        begun = time.monotonic()
        with pytest.raises(AgentError) as caught:
            robot.close()
        assert time.monotonic() - begun < 1 + BUSY
        assert re.fullmatch(
            r"robot/b: exchange\(\) hangs for \d\.\d s \(parts\.py, line \d+, in "
            r"exchange\): it may drive on; switch it off\. \(R0311\)",
            str(caught.value),
        )
        # It is told as soon as the call returns, and the thread ends.
        until(lambda: not device_threads())
        assert device.speed == 0.0


class Stubborn(SerialCart):
    """Goes on asking a device that does not answer."""

    timeout = 0.45


def test_close_of_a_device_that_does_not_answer(tmp_path: Path) -> None:
    with Device(tmp_path) as device:
        robot = combine(Cart, Stubborn)("b", options={"port": str(device.link)})
        robot.prepare()
        robot.open()
        device.tell("hang 2.5")
        drive(robot, 0.1)
        begun = time.monotonic()
        with pytest.raises(AgentError, match="it may drive on"):
            robot.close()
        assert time.monotonic() - begun < 1 + BUSY
        until(lambda: not device_threads())

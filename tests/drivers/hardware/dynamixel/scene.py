"""What the tests of servos share: emulated ones, and who drives them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.robot import join
from rems_net.drivers.hardware.dynamixel.arms import Arms
from rems_net.drivers.hardware.dynamixel.servos import Servos
from rems_net.drivers.hardware.dynamixel.wheels import Wheels
from rems_net.emulators.dynamixel.bus import EmulatedBus
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.terminal import Terminal
from rems_net.robots.dynabot import Dynabot
from rems_net.robots.scaler import Scaler
from tests.drivers.hardware.refusal import refusal

DEFINITIONS = {Wheels: Dynabot, Arms: Scaler}


@contextmanager
def emulated(folder: Path, device: EmulatedBus) -> Iterator[Emulator[Any]]:
    """Emulated servos at `folder`/ttyServos."""
    pytest.importorskip("pty", reason="there are no pseudo-terminals here")
    pytest.importorskip("dynamixel_sdk", reason="dynamixel-sdk is not installed")
    with Emulator(device, Terminal(folder / "ttyServos")) as emulator:
        yield emulator


def made(driver: type[Servos], **options: Any) -> Any:
    """A robot outside of a host, not opened yet."""
    robot = join(DEFINITIONS[driver], driver)("b", options=options)
    robot.prepare()
    return robot


@contextmanager
def opened(
    driver: type[Servos], emulator: Emulator[Any], **options: Any
) -> Iterator[Any]:
    """The same, opened; closed at the end."""
    robot = made(driver, port=emulator.where, **options)
    try:
        robot.open()
        yield robot
    finally:
        robot.close()


def refused(driver: type[Servos], emulator: Emulator[Any], **options: Any) -> str:
    """What it says instead of opening."""
    return refusal(made(driver, port=emulator.where, **options))


def keep(
    robot: Any,
    command: Mapping[str, float],
    until: Callable[[], Any],
    seconds: float = 20.0,
) -> Any:
    """Tell it this, as a host would, until something is so."""
    end = time.monotonic() + seconds
    while not (found := until()):
        assert time.monotonic() < end, robot.figures()
        robot.command = command
        robot.drive(robot.command, 0.02)
        robot.sense()
        time.sleep(0.02)
    return found


def keep_for(robot: Any, command: Mapping[str, float], seconds: float) -> None:
    """The same, for so long."""
    end = time.monotonic() + seconds
    keep(robot, command, lambda: time.monotonic() > end)

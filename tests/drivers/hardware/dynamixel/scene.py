"""What the tests of servos share: emulated ones, and who drives them."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.robot import combine
from rems_net.drivers.hardware.dynamixel.arms import Arms
from rems_net.drivers.hardware.dynamixel.servos import Servos
from rems_net.drivers.hardware.dynamixel.wheels import Wheels
from rems_net.emulators.dynamixel.bus import EmulatedBus
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.terminal import Terminal
from rems_net.robots.dynabot import Dynabot
from rems_net.robots.scaler import Scaler
from tests.drivers import alone
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
    return combine(DEFINITIONS[driver], driver)("b", options=options)


def opened(
    driver: type[Servos], emulator: Emulator[Any], **options: Any
) -> AbstractContextManager[Any]:
    """The same, opened; closed at the end."""
    return alone.opened(made(driver, port=emulator.where, **options))


def refused(driver: type[Servos], emulator: Emulator[Any], **options: Any) -> str:
    """What it says instead of opening."""
    robot = made(driver, port=emulator.where, **options)
    robot.prepare()
    return refusal(robot)

"""What the tests of the Create 2's driver share: an emulated one, and who drives it."""

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.robot import combine
from rems_net.drivers.hardware.create2.commands import Op
from rems_net.drivers.hardware.create2.open_interface import OpenInterface
from rems_net.emulators.create2.device import Create2Device
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.terminal import Terminal
from rems_net.robots.create2 import Create2
from tests.drivers import alone

#: mm/s of a wheel, for each rad/s
SCALE = 36.0


@contextmanager
def emulated(
    folder: Path, device: Create2Device | None = None
) -> Iterator[Emulator[Create2Device]]:
    """An emulated Create 2 at `folder`/ttyRobot."""
    pytest.importorskip("pty", reason="there are no pseudo-terminals here")
    pytest.importorskip("serial", reason="pyserial is not installed")
    made = device or Create2Device(boot=0.2)
    with Emulator(made, Terminal(folder / "ttyRobot")) as emulator:
        yield emulator


def opened(
    emulator: Emulator[Create2Device], **options: Any
) -> AbstractContextManager[Any]:
    """A driver outside of a host, opened; closed at the end."""
    both = {"port": emulator.where} | options
    return alone.opened(combine(Create2, OpenInterface)("b", options=both))


def keep(
    robot: Any,
    wheels: tuple[float, float],
    until: Callable[[], Any],
    seconds: float = 20.0,
) -> Any:
    """Tell it these speeds (left, right; mm/s), as a host would, until that is so."""
    left, right = (speed / SCALE for speed in wheels)
    command = {"wheel/left": left, "wheel/right": right}
    return alone.keep(robot, command, until, seconds)


def keep_for(robot: Any, wheels: tuple[float, float], seconds: float) -> None:
    """The same, for so long."""
    end = time.monotonic() + seconds
    keep(robot, wheels, lambda: time.monotonic() > end)


def wheels(emulator: Emulator[Create2Device]) -> tuple[int, int]:
    """What its wheels do: left, right, mm/s."""
    return emulator.device.body.left, emulator.device.body.right


def driven(emulator: Emulator[Create2Device]) -> list[tuple[int, int]]:
    """All that it ever obeyed, in its order: left, right, mm/s."""
    found = []
    for op, data in list(emulator.device.interface.done):
        if op is Op.DRIVE_DIRECT:
            right, left = (
                int.from_bytes(half, "big", signed=True)
                for half in (data[:2], data[2:])
            )
            found.append((left, right))
    return found

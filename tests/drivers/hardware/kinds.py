"""Every kind of line: its driver, what is emulated behind it, and what that obeys."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.robot import combine
from rems_net.drivers.hardware.create2.open_interface import OpenInterface
from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.wheels import Wheels
from rems_net.drivers.hardware.woodbot_websocket import OriginalFirmware
from rems_net.emulators.create2.device import Create2Device
from rems_net.emulators.dynamixel.robots import DynabotServos
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.terminal import Terminal
from rems_net.emulators.websocket import WebSocketPort
from rems_net.emulators.woodbot_websocket import OriginalWoodbot
from rems_net.robots.create2 import Create2
from rems_net.robots.dynabot import Dynabot
from rems_net.robots.woodbot import Woodbot
from tests.drivers.hardware.create2.scene import driven

STAND = {"wheel/left": 0.0, "wheel/right": 0.0}
#: rad. Two counts of the coarsest encoder, that of a Create 2.
COUNTS = 0.025
LIBRARIES = ("serial", "dynamixel_sdk", "websockets")


@dataclass(frozen=True)
class Kind:
    """ahead: a command.  goes, stands: what its wheels are told by it, and to stand.

    obeys: what they are told now, by an emulator.  told: all that they ever were, which
    is kept in lists and dicts: `kept`.
    history: all commands of its wheels, oldest first; none if the device is guarded.
    counted: how many packets its driver says were lost or damaged.
    guarded: whether the device stops by itself, where it hears nobody.
    """

    robot: Any
    device: Callable[[], Any]
    ahead: Mapping[str, float]
    goes: tuple[int, int]
    obeys: Callable[[Any], tuple[int, int]]
    told: Callable[[Any], set[int]]
    kept: Callable[[Any], list[Any]]
    stands: tuple[int, int] = (0, 0)
    history: Callable[[Any], list[tuple[int, int]]] = lambda emulator: []
    counted: Callable[[Any], int] = lambda robot: robot.figures()["rejected"]
    guarded: bool = False
    #: whether its wheels turn, where they may also stop by themselves
    turns: Callable[[Any], bool] | None = None
    at_port: bool = True

    def line(self, folder: Path) -> Terminal | WebSocketPort:
        """Return the line of an emulator; skip the test where libraries are missing."""
        for library in LIBRARIES:
            pytest.importorskip(library, reason=f"there is no {library} here")
        if not self.at_port:
            return WebSocketPort()
        pytest.importorskip("pty", reason="there are no pseudo-terminals here")
        return Terminal(folder / "port")

    def moves(self, emulator: Any) -> bool:
        """Return whether the emulated robot moves."""
        obeys = self.obeys(emulator) != self.stands
        return obeys if self.turns is None else self.turns(emulator)

    @contextmanager
    def opened(self, folder: Path, **patience: float) -> Iterator[tuple[Any, Any]]:
        """Its driver outside of a host, and the emulator. patience: max_age, silence"""
        with Emulator(self.device(), self.line(folder)) as emulator:
            where = {"port" if self.at_port else "url": emulator.where}
            robot = self.robot("b", options=where)
            vars(robot).update(patience)
            robot.prepare()
            try:
                robot.open()
                yield robot, emulator
            finally:
                robot.close()


def true(emulator: Any) -> Any:
    """Where an emulated robot really is."""
    device = emulator.device
    return getattr(device, "state", None) or getattr(device, "body", device).robot.state


def agrees(robot: Any, emulator: Any) -> bool:
    """Whether it says where it really is, within 5 mm or mrad."""
    at = true(emulator)
    return all(abs(robot.state[path] - at[path]) < 0.005 for path in ("x", "y"))


def turned(robot: Any, emulator: Any) -> bool:
    """Return whether its state has the turns of its wheels, within two counts."""
    at, wheels = true(emulator), ("wheel/left", "wheel/right")
    return all(abs(robot.state[path] - at[path]) < COUNTS for path in wheels)


def _servos(emulator: Any) -> list[Any]:
    return [emulator.device.left, emulator.device.right]


KINDS = {
    "create2": Kind(
        combine(Create2, OpenInterface),
        lambda: Create2Device(boot=0.2),
        {"wheel/left": 3.0, "wheel/right": 2.0},
        (108, 72),
        lambda emulator: (emulator.device.body.left, emulator.device.body.right),
        lambda emulator: {speed for both in driven(emulator) for speed in both},
        lambda emulator: [emulator.device.interface.done],
        history=driven,
    ),
    "dynabot": Kind(
        combine(Dynabot, Wheels),
        DynabotServos,
        {"wheel/left": 2.0, "wheel/right": 1.0},
        (83, -42),
        lambda emulator: tuple(
            s.memory[table.GOAL_VELOCITY] for s in _servos(emulator)
        ),
        lambda emulator: set().union(
            *(s.told[table.GOAL_VELOCITY] for s in _servos(emulator))
        ),
        lambda emulator: [servo.told for servo in _servos(emulator)],
        counted=lambda robot: robot.status.damaged,
        guarded=True,
        turns=lambda emulator: any(servo.speed for servo in _servos(emulator)),
    ),
    "woodbot": Kind(
        combine(Woodbot, OriginalFirmware),
        OriginalWoodbot,
        {"wheel/left": 7.3, "wheel/right": 7.3},
        (0, 0),
        lambda emulator: emulator.device.driven[-1],
        lambda emulator: {angle for both in emulator.device.driven for angle in both},
        lambda emulator: [],
        stands=(90, 90),
        history=lambda emulator: emulator.device.driven,
        at_port=False,
    ),
}

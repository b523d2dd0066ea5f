"""Create2Device: the whole robot, as an emulator runs it."""

from collections.abc import Callable, Mapping
from functools import partial
from math import degrees
from typing import Any

from rems_net.drivers.hardware.create2.packets import MODES
from rems_net.drivers.hardware.create2.readings import BUTTONS, SIDES
from rems_net.emulators.create2.body import CAPACITY, Body
from rems_net.emulators.create2.interface import Interface

#: Its first bytes after a start; a real one adds more about its version.
BANNER = b"bl-start\r\nr3_robot/tags/release-3.5.4\r\n"

Happening = Callable[[], None]


class Create2Device:
    """A new Create 2: switched on, and its interface off.

    boot: s that it takes to start, a guess.
    """

    period = 0.015

    def __init__(self, boot: float = 3.0):
        self.boot = boot
        self.body = Body()
        self.interface = Interface(self.body)
        self._starts_in = 0.0

    @property
    def baud(self) -> int:
        """Bits per second of the device."""
        return self.interface.baud

    @property
    def words(self) -> Mapping[str, Mapping[str, Happening]]:
        """Events that can happen to it, by word."""
        bumps = {side: {side} for side in SIDES} | {"both": {*SIDES}, "none": set()}
        return {
            "bump": {word: self._sets("bumps", to) for word, to in bumps.items()},
            "lift": {"": self._sets("lifted", True)},
            "lower": {"": self._sets("lifted", False)},
            "cliff": {"": self._sets("cliff", True)},
            "floor": {"": self._sets("cliff", False)},
            "charger": {
                "in": self._sets("charger", True),
                "out": self._sets("charger", False),
            },
            "battery": {
                "true": self._sets("reports", None),
                "impossible": self._sets("reports", (65_529, CAPACITY)),
                "unknown": self._sets("reports", (0, 0)),
            },
            "mode": {
                "right": partial(setattr, self.interface, "too_high", 0),
                "plus-one": partial(setattr, self.interface, "too_high", 1),
            },
            "press": {one: partial(self.body.press, one) for one in BUTTONS},
        }

    def hear(self, portion: bytes) -> list[bytes]:
        """Obey, if it is not still starting."""
        if self._starts_in > 0:
            return []
        answers = self.interface.hear(portion)
        if self.interface.resets:
            return [*answers, *self.power(True)]
        return answers

    def live(self, dt: float) -> list[bytes]:
        """Let `dt` seconds pass; return the stream of its sensors."""
        self._starts_in = max(0.0, self._starts_in - dt)
        self.body.move(dt)
        return self.interface.tick(dt)

    def power(self, on: bool) -> list[bytes]:
        """Lose its power (False), or start (True)."""
        self.interface.restart()
        self._starts_in = self.boot if on else 0.0
        return [BANNER] if on else []

    def status(self) -> str:
        """Return its state in a few words."""
        state, body = self.body.robot.state, self.body
        mode = MODES[self.interface.mode]
        return (
            f"{mode}, left {body.left} mm/s, right {body.right} mm/s; x {state.x:.2f} "
            f"m, y {state.y:.2f} m, heading {degrees(state.heading):.0f} degrees"
        )

    def _sets(self, name: str, value: Any) -> Happening:
        return partial(setattr, self.body, name, value)

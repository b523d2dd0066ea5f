"""A page in Chromium, and a robot at the page's serial port.

The page's `navigator.serial` is fake_serial.js; what is written there goes to a robot's
pseudo-terminal, and back. If both ends have other speeds, each reads what a UART would
make of it.
"""

import json
import time
from pathlib import Path
from typing import Any

from tests.dashboard.browser import Browser
from tests.firmware.console.chromium.uart import received
from tests.firmware.console.robot import TIMEOUT, Robot

FAKE = Path(__file__).with_name("fake_serial.js")
#: s. A robot that has the cable for a network repeats a frame as often.
AGAIN = 0.2


class Page:
    """A page, and the robot at its port. `chatter`: what the robot repeats unasked."""

    def __init__(self, tab: Browser, robot: Robot, address: str):
        self.tab, self.robot = tab, robot
        self.baud, self.robots_baud = 0, 115_200
        self.chatter = b""
        #: errors that the page's stream had
        self.errors: list[str] = []
        self._spoken = 0.0
        tab.called.clear()
        tab.go(address)

    def click(self, element: str) -> None:
        """Click an element, as a user does."""
        self.tab.click(f"document.getElementById('{element}')")

    def until(self, expression: str) -> Any:
        """Carry bytes until an expression of the page is true; return its value."""
        end = time.monotonic() + TIMEOUT
        while not (value := self.tab.run(expression)):
            shown = self.tab.run("document.body && document.body.innerText")
            assert time.monotonic() < end, f"{expression}; the page shows: {shown}"
            self._carry()
        return value

    def _carry(self) -> None:
        """Move bytes in both directions once; wait for a few milliseconds."""
        self._take(0.005)
        portion = self.robot.read()
        if self.chatter and time.monotonic() > self._spoken + AGAIN:
            self._spoken = time.monotonic()
            portion += self.chatter
        if portion and self.baud:
            self._receive(portion)

    def _receive(self, portion: bytes) -> None:
        calls, held = [], list[int]()
        for one in received(portion, self.robots_baud, self.baud):
            if isinstance(one, int):
                held.append(one)
                continue
            calls += [f"cable.receive({held})", f"cable.fail('{one}')"]
            self.errors.append(one)
            held = []
        calls.append(f"cable.receive({held})")
        self.tab.run(f"{'; '.join(calls)}; null")

    def _take(self, seconds: float) -> None:
        """Obey what the page did with its port, for at most so long."""
        self.tab.wait(seconds)
        while self.tab.called:
            done: dict[str, Any] = json.loads(self.tab.called.popleft())
            self.baud = done.get("open", self.baud)
            if "bytes" in done:
                heard = received(bytes(done["bytes"]), self.baud, self.robots_baud)
                self.robot.write(bytes(b for b in heard if isinstance(b, int)))

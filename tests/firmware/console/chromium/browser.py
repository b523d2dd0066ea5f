"""Chromium without a window, a page in it, and a robot at the page's serial port.

The browser is driven by its own DevTools protocol. The page's `navigator.serial` is
fake_serial.js; what is written there goes to a robot's pseudo-terminal, and back. If
both ends have other speeds, each reads what a UART would make of it.
"""

import json
import os
import select
import shutil
import subprocess
import time
from base64 import b64decode
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from tests.firmware.console.chromium.uart import received
from tests.firmware.console.robot import TIMEOUT, Robot

HERE = Path(__file__).parent
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")
#: s. A robot that has the cable for a network repeats a frame as often.
AGAIN = 0.2


class Browser:
    """A browser in a folder of its own, driven through two pipes; `close` ends it."""

    def __init__(self, folder: Path):
        found = next(filter(None, map(shutil.which, NAMES)), None)
        if found is None:
            pytest.skip(f"There is no browser here: none of {', '.join(NAMES)}.")
        words = [found, "--headless=new", "--remote-debugging-pipe", "--disable-gpu"]
        words += ["--no-first-run", "--disable-extensions", "--window-size=900,1200"]
        words += [f"--user-data-dir={folder}", "about:blank"]
        if os.geteuid() == 0:
            words.append("--no-sandbox")  # its sandbox does not run as root
        its_in, self._to = os.pipe()
        self._from, its_out = os.pipe()
        # It reads from descriptor 3, and writes to descriptor 4.
        moved = f'exec "$@" 3</dev/fd/{its_in} 4>/dev/fd/{its_out}'
        self._process = subprocess.Popen(
            ["sh", "-c", moved, "sh", *words],
            pass_fds=(its_in, its_out),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(its_in)
        os.close(its_out)
        self._held = b""
        self._asked = 0
        self.events = deque[dict[str, Any]]()

    def close(self) -> None:
        self._process.terminate()
        self._process.wait(TIMEOUT)
        os.close(self._to)
        os.close(self._from)

    def call(self, method: str, session: str = "", **params: object) -> dict[str, Any]:
        """Return the result of a method of the DevTools protocol."""
        self._asked += 1
        request: dict[str, Any] = {"id": self._asked, "method": method}
        request |= {"params": params} | ({"sessionId": session} if session else {})
        os.write(self._to, json.dumps(request).encode() + b"\0")
        while (answer := self._read(TIMEOUT)).get("id") != self._asked:
            self.events.append(answer)
        assert "result" in answer, answer
        found: dict[str, Any] = answer["result"]
        return found

    def wait(self, seconds: float) -> None:
        """Keep the events of at most so long."""
        with suppress(TimeoutError):
            self.events.append(self._read(seconds))

    def _read(self, seconds: float) -> dict[str, Any]:
        while b"\0" not in self._held:
            if not select.select([self._from], [], [], seconds)[0]:
                raise TimeoutError("the browser does not answer")
            portion = os.read(self._from, 1 << 20)
            assert portion, "the browser has ended"
            self._held += portion
        text, _, self._held = self._held.partition(b"\0")
        read: dict[str, Any] = json.loads(text)
        return read


class Page:
    """A page, and the robot at its port. `chatter`: what the robot repeats unasked."""

    def __init__(self, browser: Browser, robot: Robot, address: str):
        self.robot = robot
        self.baud, self.robots_baud = 0, 115_200
        self.chatter = b""
        #: errors that the page's stream had
        self.errors: list[str] = []
        self._browser, self._spoken = browser, 0.0
        self._session = ""
        made = self._call("Target.createTarget", url="about:blank")
        self._target = made["targetId"]
        made = self._call("Target.attachToTarget", targetId=self._target, flatten=True)
        self._session = made["sessionId"]
        for domain in ("Page", "Runtime"):
            self._call(f"{domain}.enable")
        self._call("Runtime.addBinding", name="toTest")
        source = (HERE / "fake_serial.js").read_text(encoding="utf-8")
        self._call("Page.addScriptToEvaluateOnNewDocument", source=source)
        self._call("Page.navigate", url=address)
        blank = "location.href === 'about:blank'"
        self.until(f"document.readyState === 'complete' && !({blank})")

    def close(self) -> None:
        """Close the page."""
        self._session = ""
        self._call("Target.closeTarget", targetId=self._target)
        self._browser.events.clear()

    def look(self, expression: str, gesture: bool = False) -> Any:
        """Return the value of an expression of the page, at once."""
        done = self._call(
            "Runtime.evaluate",
            expression=expression,
            returnByValue=True,
            userGesture=gesture,
        )
        assert "exceptionDetails" not in done, done
        return done["result"].get("value")

    def click(self, element: str) -> None:
        """Click an element, as a user does."""
        self.look(f"document.getElementById('{element}').click()", gesture=True)

    def until(self, expression: str) -> Any:
        """Carry bytes until an expression of the page is true; return its value."""
        end = time.monotonic() + TIMEOUT
        while not (value := self.look(expression)):
            shown = self.look("document.body && document.body.innerText")
            assert time.monotonic() < end, f"{expression}; the page shows: {shown}"
            self._carry()
        return value

    def picture(self, path: Path) -> None:
        """Write what the page looks like to a PNG file."""
        path.write_bytes(b64decode(self._call("Page.captureScreenshot")["data"]))

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
        self.look(f"{'; '.join(calls)}; null")

    def _take(self, seconds: float) -> None:
        """Obey what the page did with its port, for at most so long."""
        self._browser.wait(seconds)
        while self._browser.events:
            event = self._browser.events.popleft()
            if event.get("method") != "Runtime.bindingCalled":
                continue
            done = json.loads(event["params"]["payload"])
            self.baud = done.get("open", self.baud)
            if "bytes" in done:
                heard = received(bytes(done["bytes"]), self.baud, self.robots_baud)
                self.robot.write(bytes(b for b in heard if isinstance(b, int)))

    def _call(self, method: str, **params: object) -> dict[str, Any]:
        return self._browser.call(method, self._session, **params)

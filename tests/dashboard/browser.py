"""A real browser, driven by its DevTools socket: as a hand and an eye would."""

from __future__ import annotations

import base64
import itertools
import json
import os
import shutil
import subprocess
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest
from websockets.sync.client import ClientConnection, connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")
#: s. A page shows what is waited for within this time, also on a busy machine.
TIMEOUT = 30.0
#: No pings: their thread uses `random` meanwhile, and hypothesis, which counts on its
#: numbers, would call any test in this process flaky.
SOCKET: dict[str, Any] = {"max_size": None, "compression": None, "ping_interval": None}


class Chromium:
    """A headless browser as a whole.

    process: of the browser, which leads a group of its own.
    """

    def __init__(self, socket: ClientConnection, process: subprocess.Popen[str]):
        self._socket, self.process = socket, process
        self._ids = itertools.count(1)

    def send(self, method: str, **params: Any) -> Any:
        """Call a method of the protocol; return its result."""
        number = next(self._ids)
        words = {"id": number, "method": method, "params": params}
        self._socket.send(json.dumps(words))
        while True:
            found = json.loads(self._socket.recv(TIMEOUT))
            if found.get("id") == number:
                assert "error" not in found, found["error"]
                return found["result"]
            self._note(found)

    def _note(self, found: dict[str, Any]) -> None:
        """Note what is reported unasked."""

    @contextmanager
    def apart(self) -> Iterator[Browser]:
        """Open a tab in a window of its own. It has its own cookies and storage."""
        made = self.send("Target.createBrowserContext")
        try:
            with self._opened(**made) as tab:
                yield tab
        finally:
            self.send("Target.disposeBrowserContext", **made)

    @contextmanager
    def _opened(self, **more: Any) -> Iterator[Browser]:
        made = self.send("Target.createTarget", url="about:blank", **more)
        host, port = self._socket.remote_address[:2]
        url = f"ws://{host}:{port}/devtools/page/{made['targetId']}"
        with connect(url, **SOCKET) as socket:
            yield Browser(socket, self.process)


class Browser(Chromium):
    """One tab of a headless browser."""

    def __init__(self, socket: ClientConnection, process: subprocess.Popen[str]):
        super().__init__(socket, process)
        #: texts of errors in the page, and violations of its policy
        self.errors: list[str] = []
        #: what the page gave to bindings
        self.called: deque[str] = deque()
        for domain in ("Page", "Runtime", "Log"):
            self.send(f"{domain}.enable")

    @contextmanager
    def other(self) -> Iterator[Browser]:
        """Open another tab of this window, in front of this one."""
        with self._opened(browserContextId=self.context) as made:
            yield made

    @property
    def context(self) -> str:
        """Identifier of the tab's browser context: what tabs of one window share."""
        found = self.send("Target.getTargetInfo")["targetInfo"]
        return str(found["browserContextId"])

    def wait(self, seconds: float) -> None:
        """Note what the page reports next, within so long."""
        with suppress(TimeoutError):
            self._note(json.loads(self._socket.recv(seconds)))

    def _note(self, found: dict[str, Any]) -> None:
        params = found.get("params", {})
        if found.get("method") == "Runtime.bindingCalled":
            self.called.append(params["payload"])
        if found.get("method") == "Runtime.exceptionThrown":
            self.errors.append(str(params["exceptionDetails"]))
        if found.get("method") == "Log.entryAdded":
            entry = params["entry"]
            if entry["level"] == "error":
                self.errors.append(f"{entry['text']} {entry.get('url', '')}")

    def run(self, code: str) -> Any:
        """Return the value of an expression in the page; it may be a promise."""
        done = self.send(
            "Runtime.evaluate", expression=code, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in done, done["exceptionDetails"]
        return done["result"].get("value")

    def until(self, code: str) -> Any:
        """Return the value of an expression once it is true."""
        end = time.monotonic() + TIMEOUT
        while time.monotonic() < end:
            if found := self.run(code):
                return found
            time.sleep(0.02)
        text = self.run("document.body.innerText")
        raise AssertionError(f"never true: {code}; errors {self.errors}; {text}")

    def go(self, url: str) -> None:
        """Open a page; a link that differs in its fragment alone, too."""
        self.send("Page.navigate", url="about:blank")
        self.send("Page.navigate", url=url)
        self.until(
            "document.readyState === 'complete' && location.href !== 'about:blank'"
        )

    def size(self, width: int, height: int, *, dark: bool = False) -> None:
        """Set the size of the window and the scheme of its colours."""
        self.send(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )
        scheme = {
            "name": "prefers-color-scheme",
            "value": "dark" if dark else "light",
        }
        self.send("Emulation.setEmulatedMedia", features=[scheme])

    def place(self, code: str) -> tuple[float, float]:
        """Return the middle of an element, which comes into view first."""
        found = self.run(
            f"(() => {{ const e = {code}; e.scrollIntoView({{block: 'nearest'}});"
            "const r = e.getBoundingClientRect();"
            "return [r.x + r.width / 2, r.y + r.height / 2]; })()"
        )
        return float(found[0]), float(found[1])

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        self.send(
            "Input.dispatchMouseEvent",
            type=kind,
            x=x,
            y=y,
            button="left",
            clickCount=1,
            **more,
        )

    def click(self, code: str, hold: str = "") -> None:
        """Press the mouse on an element; let it go once `hold` is true there."""
        x, y = self.place(code)
        self.mouse("mousePressed", x, y)
        if hold:
            self.until(hold)
        self.mouse("mouseReleased", x, y)

    def key(self, key: str, code: str, text: str = "") -> None:
        """Press a key and let it go."""
        for kind in ("keyDown", "keyUp"):
            more = {"text": text} if text and kind == "keyDown" else {}
            self.send("Input.dispatchKeyEvent", type=kind, key=key, code=code, **more)

    def picture(self, file: Path) -> None:
        """Write what is to be seen as a PNG."""
        shot = self.send("Page.captureScreenshot", format="png")
        file.write_bytes(base64.b64decode(shot["data"]))


@contextmanager
def browser(folder: Path, *more: str) -> Iterator[Browser]:
    """Start a browser of its own, with more words; yield its tab."""
    with started(folder, *more) as made:
        host, port = made._socket.remote_address[:2]
        with urlopen(f"http://{host}:{port}/json/list") as answer:
            tabs = json.loads(answer.read())
        url = next(one["webSocketDebuggerUrl"] for one in tabs if one["type"] == "page")
        with connect(url, **SOCKET) as socket:
            yield Browser(socket, made.process)


@contextmanager
def started(folder: Path, *more: str) -> Iterator[Chromium]:
    """Start a headless browser, with more words. Skip the test if there is none."""
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        pytest.skip("There is no browser here (Chromium)")
    words = [
        *(program, "--headless", "--remote-debugging-port=0", "--disable-gpu"),
        *(f"--user-data-dir={folder / 'browser'}", "--no-first-run"),
        *("--disable-background-networking", "--disable-component-update"),
        # Else it loads two hidden pages, which take half of the time of a start.
        "--disable-features=WebUIOmniboxPopup,WebUIOmniboxAimPopup",
        # WebGL without a graphics card.
        *(
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--hide-scrollbars",
        ),
        *(*more, "about:blank"),
    ]
    if getattr(os, "geteuid", lambda: 1)() == 0:
        words.insert(1, "--no-sandbox")
    process = subprocess.Popen(
        words, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        assert process.stderr is not None
        line = next(one for one in process.stderr if "DevTools listening" in one)
        with connect(line.split()[-1], **SOCKET) as socket:
            yield Chromium(socket, process)
    finally:
        process.terminate()
        process.communicate()


@contextmanager
def page_at(link: str, chromium: Chromium, ready: str) -> Iterator[Browser]:
    """Open a page and wait until it is ready; at the end it must have no errors."""
    with chromium.apart() as made:
        made.size(1280, 800)
        made.go(link)
        made.until(ready)
        yield made
        assert made.errors == []

"""A run, its page and a browser in which a person drives; and what the fabric hears."""

import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Condition
from typing import NamedTuple

import pytest

from rems_net.client import Fabric, join
from rems_net.router.mail import Mail
from tests.agents.runs import until
from tests.commands import link_of
from tests.dashboard.browser import Browser, browser
from tests.dashboard.test_page import Lab

SCRIPT = """
from rems_net import Experiment
lab = Experiment("hands", dt="20 ms", duration="7200 s", pace=1)
lab.robot("bot", "woodbot", "kinematic")
lab.run("out")
"""
BOT = "robot/bot"
KEY = {"code": "KeyW", "key": "w", "windowsVirtualKeyCode": 87}
DRIVES = f"rems.drive.beat > 0 && rems.drive.driving['{BOT}']?.drives"
#: a gamepad of the browser, which no program can plug in: `pad` is what a page reads
PAD = "window.pad = null; navigator.getGamepads = () => [window.pad, null];"
BACK = "document.getElementById('away')?.remove(); window.focus(); window.pad = null; 1"


class Said(NamedTuple):
    """A command on the fabric: when it came [s], and whether wheels turn by it."""

    at: float
    moves: bool


class Scene:
    """A run, its page, a browser that drives by it, and an ear on the fabric."""

    def __init__(self, folder: Path, stack: ExitStack):
        self.folder, self._stack = folder, stack
        self.lab = stack.enter_context(_lab(folder))
        self.fabric: Fabric = stack.enter_context(join())
        self._command = self.fabric.schemas(BOT)["command"]
        self._came = Condition()
        self._own = 0
        #: commands of the person, and those that the robot obeys
        self.hand: list[Said] = []
        self.obeyed: list[Said] = []
        key = self.fabric.session.key(BOT, "command")
        self.fabric.session.watch_at_once(key, self._hear)
        until(lambda: self._own)
        self._browsers: ExitStack | None = None
        self._tabs: ExitStack | None = None
        self.base: Browser | None = None
        self.tab: Browser | None = None

    def _hear(self, mail: Mail) -> None:
        moves = bool(self._command.decode(mail.payload)["wheel/left"])
        badge = mail.stamp().badge
        with self._came:
            self._own = self._own or badge
            some = self.obeyed if badge == self._own else self.hand
            some.append(Said(time.monotonic(), moves))
            self._came.notify_all()

    def wait(self, come: Callable[[], Said | None], seconds: float) -> Said | None:
        """Return the command that is looked for; None if it does not come."""
        with self._came:
            self._came.wait_for(lambda: come() is not None, seconds)
            return come()

    def forget(self) -> None:
        with self._came:
            self.hand.clear()
            self.obeyed.clear()

    # -- until a page drives ----------------------------------------------------------

    def ready(self) -> Browser:
        """Return a page that drives the robot; open what was closed or killed."""
        if self.lab.served.poll() is not None:
            self.lab.serve()
            self.close_tab()
        if self.base is None or self.base.process.poll() is not None:
            self._open_browser()
        assert self.base is not None
        if self.tab is None:
            self._tabs = ExitStack()
            self.tab = tab = self._tabs.enter_context(self.base.other())
            tab.send("Page.addScriptToEvaluateOnNewDocument", source=PAD)
            tab.size(320, 240)  # little to draw
            tab.go(self.lab.link)
            choice = "[...rems.drive.choice.options]"
            tab.until(f"{choice}.some((one) => one.value === '{BOT}')")
            tab.until(f"(rems.drive.drive(['{BOT}']), true)")
        self.tab.send("Page.bringToFront")
        self.tab.run(BACK)
        self.tab.send("Input.dispatchKeyEvent", type="keyUp", **KEY)
        rests = "rems.drive.fresh && rems.drive.resting && !rems.drive.locked"
        self.tab.until(f"{DRIVES} && {rests}")
        return self.tab

    def _open_browser(self) -> None:
        self.close_browser()
        self._browsers = ExitStack()
        folder = self.folder / f"browser-{time.monotonic_ns()}"
        self.base = self._browsers.enter_context(browser(folder))

    def close_tab(self) -> None:
        tabs, self._tabs, self.tab = self._tabs, None, None
        if tabs is not None:
            tabs.close()

    def close_browser(self) -> None:
        self.close_tab()
        browsers, self._browsers, self.base = self._browsers, None, None
        if browsers is not None:
            browsers.close()

    def close(self) -> None:
        self.close_browser()


class Room(Lab):
    """A run of one robot; its page can be killed and served again."""

    served: subprocess.Popen[str]

    def _begin(self, folder: Path) -> str:
        (folder / "lab.py").write_text(SCRIPT, encoding="utf-8")
        self._run()
        return self.serve()

    def serve(self) -> str:
        """Serve the page; return its link."""
        page = self.start("dashboard", "--no-qr", stdout=subprocess.PIPE)
        self.served = page
        self._started.append(page)
        self.link = link_of(page)
        return self.link


@contextmanager
def _lab(folder: Path) -> Iterator[Room]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(folder / "rt"))
        made = Room(folder)
        try:
            yield made
        finally:
            made.close()

"""Driving in a real browser: keys, a finger, and all the ways to let go."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.client import Fabric, join
from rems_net.client.driving import Driving
from tests.agents.runs import until
from tests.dashboard.browser import Browser, browser
from tests.dashboard.test_page import Lab

KEYS = {"ArrowUp": 38, "ArrowLeft": 37, "KeyW": 87}
BOT = "robot/bot"
#: the page drives: it has the lease, and its picture is new
DRIVES = f"rems.drive.beat > 0 && rems.drive.driving['{BOT}']?.drives"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    made = Lab(tmp_path_factory.mktemp("drive"))
    try:
        yield made
    finally:
        made.close()


@pytest.fixture(scope="module")
def here(lab: Lab, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fabric]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(lab.folder / "rt"))
        with join() as fabric:
            yield fabric


@pytest.fixture
def tab(lab: Lab, here: Fabric, tmp_path: Path) -> Iterator[Browser]:
    """A page that drives robot/bot."""
    until(lambda: not here.drivers())
    with browser(tmp_path / "browser") as made:
        made.size(1280, 800)
        made.go(lab.link)
        made.until(f"[...rems.drive.choice.options].some(o => o.value === '{BOT}')")
        made.run(f"rems.drive.choice.value = '{BOT}'")
        made.click("rems.drive.button")
        made.until(DRIVES)
        yield made
        assert made.errors == []


def key(tab: Browser, kind: str, code: str) -> None:
    name = code.removeprefix("Key").lower() if code.startswith("Key") else code
    tab.send(
        "Input.dispatchKeyEvent",
        type=kind,
        code=code,
        key=name,
        windowsVirtualKeyCode=KEYS[code],
    )


def moved(here: Fabric) -> None:
    """Wait until the robot drives."""
    bot = here.robot("bot")
    before = bot.state.get()
    until(
        lambda: abs(bot.state.x - before["x"]) + abs(bot.state.y - before["y"]) > 0.01
    )


def stands(here: Fabric) -> None:
    """Wait until the robot stands: five states alike."""
    bot = here.robot("bot")

    def still() -> bool:
        first, *others = list(bot.watch("state", 5))
        return all(one == first for one in others)

    until(still)


def test_arrow_keys(tab: Browser, here: Fabric) -> None:
    name = here.drivers()[BOT]
    assert tab.until(f"rems.drive.choice.textContent.includes({name!r})")
    key(tab, "keyDown", "ArrowUp")
    moved(here)
    key(tab, "keyUp", "ArrowUp")
    stands(here)
    heading = float(here.robot("bot").state.heading)
    key(tab, "keyDown", "ArrowLeft")
    until(lambda: here.robot("bot").state.heading > heading + 0.1)
    key(tab, "keyUp", "ArrowLeft")
    stands(here)
    tab.click("rems.drive.button")
    until(lambda: BOT not in here.drivers())


def test_a_finger_on_the_stick(tab: Browser, here: Fabric) -> None:
    x, y = tab.place("document.getElementById('pad')")
    tab.mouse("mousePressed", x, y)
    tab.mouse("mouseMoved", x, y - 60)
    moved(here)
    tab.mouse("mouseReleased", x, y - 60)
    stands(here)


LET_GO = {
    "blur": "window.dispatchEvent(new Event('blur'))",
    "hidden": "Object.defineProperty(document, 'hidden', {value: true}),"
    "document.dispatchEvent(new Event('visibilitychange'))",
    "a lost connection": "rems.link.socket.close()",
}


@pytest.mark.parametrize("way", LET_GO)
def test_letting_go(tab: Browser, here: Fabric, way: str) -> None:
    key(tab, "keyDown", "KeyW")
    moved(here)
    tab.run(f"{{ {LET_GO[way]} }}" if "," not in LET_GO[way] else LET_GO[way])
    stands(here)


def test_a_frozen_page_lets_go(tab: Browser, here: Fabric) -> None:
    """The page's own program hangs for 1.5 s, with a key held down."""
    key(tab, "keyDown", "KeyW")
    moved(here)
    tab.run(
        "setTimeout(() => { const t = Date.now(); while (Date.now() < t + 1500); })"
    )
    stands(here)


def test_what_a_network_has_held_up_is_not_obeyed(tab: Browser, here: Fabric) -> None:
    """Messages for an old picture: those that the page has sent, sent again later."""
    tab.run(
        "window.sent = []; const send = rems.link.send.bind(rems.link);"
        "rems.link.send = (m) => { window.sent.push(m); send(m); }; 1"
    )
    key(tab, "keyDown", "KeyW")
    moved(here)
    key(tab, "keyUp", "KeyW")
    stands(here)
    time.sleep(0.7)
    before = here.robot("bot").state.get()
    count = tab.run(
        "window.sent.filter((m) => m.hand.held.length)"
        ".map((m) => rems.link.socket.send(JSON.stringify(m))).length"
    )
    assert count > 0
    for state in here.robot("bot").watch("state", 20):
        assert state == before


def test_another_person_and_a_teacher(tab: Browser, here: Fabric) -> None:
    with Driving(here, BOT, by="ben") as ben:
        assert not ben.drives

        def handed() -> bool:
            ben.keep()
            time.sleep(0.1)
            return ben.drives

        said = "document.getElementById('driving').textContent"
        ben.keep()
        tab.until(f"{said}.includes('ben on ')")
        until(handed)
        tab.until("rems.drive.agents.length === 0")
        tab.until("document.getElementById('log').textContent.includes('was taken by')")


def test_what_cannot_be_driven_is_a_sentence(tab: Browser) -> None:
    tab.run("rems.drive.drive(['robot/euler'])")
    tab.until(
        "document.getElementById('log').textContent.includes("
        "'input/wave commands robot/euler there')"
    )
    assert tab.run("rems.drive.agents.length") == 0

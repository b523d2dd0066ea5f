"""Driving in a real browser: keys, a finger, and all the ways to let go."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from rems_net.client import Fabric, join
from rems_net.client.driving import Driving
from tests.agents.runs import until
from tests.dashboard.browser import Browser, Chromium
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
def tab(lab: Lab, here: Fabric, chromium: Chromium) -> Iterator[Browser]:
    """A page that drives robot/bot."""
    until(lambda: not here.drivers())
    with chromium.apart() as made:
        made.size(1280, 800)
        made.go(lab.link)
        made.until(f"[...rems.drive.choice.options].some(o => o.value === '{BOT}')")
        made.run(f"rems.drive.choice.value = '{BOT}'")
        made.click("rems.drive.button")
        made.until(DRIVES)
        yield made
        assert made.errors == []


def key(tab: Browser, kind: str, code: str, repeated: bool = False) -> None:
    name = code.removeprefix("Key").lower() if code.startswith("Key") else code
    tab.send(
        "Input.dispatchKeyEvent",
        type=kind,
        code=code,
        key=name,
        windowsVirtualKeyCode=KEYS[code],
        autoRepeat=repeated,
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


def test_a_key_that_repeats_no_more(tab: Browser, here: Fabric) -> None:
    key(tab, "keyDown", "KeyW")
    moved(here)
    key(tab, "keyDown", "KeyW", repeated=True)
    tab.until("document.getElementById('log').textContent.includes('repeats no more')")
    stands(here)
    key(tab, "keyDown", "KeyW", repeated=True)
    stands(here)
    assert tab.run("rems.drive.resting")
    key(tab, "keyUp", "KeyW")
    key(tab, "keyDown", "KeyW")
    moved(here)
    key(tab, "keyUp", "KeyW")
    stands(here)


def test_a_finger_on_the_stick(tab: Browser, here: Fabric) -> None:
    x, y = tab.place("document.getElementById('pad')")
    tab.mouse("mousePressed", x, y)
    tab.mouse("mouseMoved", x, y - 60)
    moved(here)
    tab.mouse("mouseReleased", x, y - 60)
    stands(here)


def test_a_finger_that_never_rests(tab: Browser, here: Fabric) -> None:
    """200 moves: the page sends fewer than the 60 a second at which it is closed."""
    x, y = tab.place("document.getElementById('pad')")
    tab.mouse("mousePressed", x, y)
    tab.run(
        "window.sent = 0; const send = rems.link.send.bind(rems.link);"
        "rems.link.send = (m) => { window.sent += 1; send(m); };"
        "window.begun = performance.now(); 1"
    )
    for i in range(200):
        tab.mouse("mouseMoved", x + i % 9, y - 60)
    rate = tab.run("window.sent / (performance.now() - window.begun) * 1000")
    assert 0 < rate < 45
    tab.mouse("mouseReleased", x, y - 60)
    stands(here)
    assert tab.run("rems.link.socket.readyState === WebSocket.OPEN")


def pads(
    tab: Browser, *ahead: float, mapping: str = "standard", silent: bool = False
) -> None:
    """Show gamepads to the page: a browser of DevTools has none to plug in."""
    sent = "timestamp: 1" if silent else "get timestamp() { return performance.now() }"
    rows = [
        f"{{mapping: '{mapping}', id: 'pad {i}', axes: [0, {0 - one}, 0], {sent}}}"
        for i, one in enumerate(ahead)
    ]
    tab.run(
        f"window.nan = NaN; window.pads = [null, {', '.join(rows)}];"
        "navigator.getGamepads = () => window.pads; 1"
    )


def test_gamepads(tab: Browser, here: Fabric) -> None:
    said = "document.getElementById('driving').textContent"
    tab.send("Page.bringToFront")
    pads(tab, 0.0, 0.0)
    tab.until("!rems.drive.locked")
    pads(tab, 0.8, 0.0)
    moved(here)
    pads(tab, 0.8, 0.8)
    tab.until(f"{said} === 'Two gamepads are moved, so robots stand: let go of one.'")
    stands(here)
    pads(tab, 0.8, 0.1)  # the other one is within its dead zone
    moved(here)
    tab.run("window.dispatchEvent(new Event('gamepaddisconnected'))")
    pads(tab)
    tab.until("document.getElementById('log').textContent.includes('pulled out')")
    stands(here)
    pads(tab, 0.8, mapping="")
    tab.until(f"{said}.includes('does not know the axes of pad 0')")
    stands(here)
    pads(tab, float("nan"))
    tab.until(f"!{said}.includes('axes')")
    assert tab.run("rems.drive.resting")


def test_a_gamepad_that_goes_silent(tab: Browser, here: Fabric) -> None:
    """One that trembles drives on; a silent one may be out of range."""
    said = "document.getElementById('driving').textContent"
    tab.send("Page.bringToFront")
    pads(tab, 0.0)
    tab.until("!rems.drive.locked")
    pads(tab, 0.8)
    tab.run("window.begun = performance.now(); 1")
    tab.until("performance.now() > window.begun + 1500")
    moved(here)
    pads(tab, 0.8, silent=True)
    tab.until(f"{said}.startsWith('The gamepad has sent nothing for 1 s')")
    stands(here)
    pads(tab, 0.7)  # it is back, and still pushed
    stands(here)
    assert tab.run("rems.drive.resting")
    pads(tab, 0.0)
    tab.until("!rems.drive.locked")
    pads(tab, 0.8)
    moved(here)
    pads(tab, 0.0)
    stands(here)


def test_a_gamepad_of_a_page_without_focus_moves_nothing(
    tab: Browser, here: Fabric
) -> None:
    """Browsers report its last position there; and it has to rest once afterwards."""
    tab.send("Page.bringToFront")
    pads(tab, 0.0)
    tab.until("!rems.drive.locked")
    pads(tab, 0.8)
    moved(here)
    with tab.other():
        tab.until("document.hidden && rems.drive.resting")
        stands(here)
    tab.send("Page.bringToFront")
    tab.until("!document.hidden && document.hasFocus() && rems.drive.fresh")
    stands(here)
    pads(tab, 0.0)
    tab.until("!rems.drive.locked")
    pads(tab, 0.8)
    moved(here)
    pads(tab, 0.0)
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
    newest = "Math.max(...window.sent.map((m) => m.beat))"
    tab.until(f"rems.drive.beat > {newest} + 6")  # of 0.1 s each
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

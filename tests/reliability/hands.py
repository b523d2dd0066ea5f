"""How many seconds after a person lets go the safe command is on the fabric."""

import os
import random
import signal
import statistics
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from tests.dashboard.browser import Browser
from tests.reliability.browsing import KEY, Said, Scene
from tests.reliability.page import Section, table

STICK = (
    "window.pad = {mapping: 'standard', index: 0, id: 'a', axes: [0, -0.8, 0, 0],"
    " get timestamp() { return performance.now(); }}; 1"
)
#: focus in a frame of the page takes it from the page, as another window does
BLUR = (
    "(() => { const f = document.createElement('iframe'); f.id = 'away';"
    "document.body.append(f); f.contentWindow.focus(); })()"
)
#: s. Limit of a safe command; and of a robot's max_age, as in the tables before.
LIMIT, MAX_AGE = 0.3, 0.6
#: s. After the safe command so long nothing else may come.
AFTER = 0.3
#: s. A trial that takes longer has failed.
LONGEST = 3.0


@dataclass(frozen=True)
class Way:
    """A way to let go. do: lets go; returns once it is done.  undo: makes it good."""

    title: str
    do: Callable[[Scene, Browser], object]
    undo: Callable[[Scene], object] = lambda scene: None
    limit: float = LIMIT
    #: what a person moves
    pad: bool = False

    @property
    def by_robot(self) -> bool:
        """Whether no safe command is put: the robot itself ends the last one."""
        return self.limit == MAX_AGE


def _signal(sign: str) -> Callable[[Scene, Browser], object]:
    """Send a signal to all processes of the browser."""
    return lambda _, tab: os.killpg(tab.process.pid, getattr(signal, sign))


def _go_on(scene: Scene) -> None:
    assert scene.base is not None
    os.killpg(scene.base.process.pid, signal.SIGCONT)


def _kill_page(scene: Scene, _: Browser) -> None:
    scene.lab.served.kill()


def _wait_for_page(scene: Scene) -> None:
    scene.lab.served.wait()


def _wait_for_browser(scene: Scene) -> None:
    assert scene.base is not None
    scene.base.process.wait()
    scene.close_browser()


WAYS = (
    Way(
        "the key comes up",
        lambda _, tab: tab.send("Input.dispatchKeyEvent", type="keyUp", **KEY),
    ),
    Way("the window loses the focus", lambda _, tab: tab.run(BLUR)),
    Way(
        "another tab hides the page",
        lambda scene, _: scene.base and scene.base.send("Page.bringToFront"),
    ),
    Way("the tab is closed", lambda _, tab: tab.send("Page.close"), Scene.close_tab),
    Way(
        "the gamepad is pulled out",
        lambda _, tab: tab.run("window.pad = null"),
        pad=True,
    ),
    Way("the browser is frozen", _signal("SIGSTOP"), _go_on),
    Way("the browser is killed", _signal("SIGKILL"), _wait_for_browser),
    Way("the page's server is killed", _kill_page, _wait_for_page, MAX_AGE),
)


@dataclass
class Found:
    """What the trials of one way showed. seconds: until the safe command came."""

    way: Way
    paused: bool
    seconds: list[float] = field(default_factory=list)
    #: sentences on trials that went wrong
    wrong: list[str] = field(default_factory=list)

    @property
    def within(self) -> int:
        """Return the number of trials within the limit."""
        return sum(one <= self.way.limit for one in self.seconds)

    def cells(self) -> list[str]:
        some, count = self.seconds, len(self.seconds)
        worst = f"{max(some):.2f}" if max(some) < LONGEST else f"> {LONGEST:g}"
        kept = f"{self.within} of {count}"
        if self.within < count or self.wrong:
            kept = f"**{kept}**"
        return [f"{statistics.median(some):.2f}", worst, kept]


def measure(
    ways: Sequence[Way],
    trials: int,
    folder: Path,
    tell: Callable[[str], None] = lambda line: None,
    paused: Sequence[bool] = (False, True),
) -> list[Found]:
    """Let go in each of these ways so often, while time goes on and while it rests."""
    found = []
    with ExitStack() as stack:
        scene = Scene(folder, stack)
        stack.callback(scene.close)
        for way in ways:
            for rests in paused:
                one = Found(way, rests)
                for _ in range(trials):
                    _try(one, scene)
                found.append(one)
                words = [way.title, "paused" if rests else "", *one.cells(), *one.wrong]
                tell(" | ".join(words))
    return found


def _try(found: Found, scene: Scene) -> None:
    """Drive, let go, and note what came."""
    way, tab = found.way, scene.ready()
    clock = scene.fabric.clock
    if found.paused:
        clock("pause")
    scene.forget()
    try:
        if way.pad:
            tab.run(STICK)
        else:
            tab.send("Input.dispatchKeyEvent", type="keyDown", **KEY)
        if scene.wait(lambda: _first(scene.hand, moves=True), LONGEST) is None:
            raise AssertionError("the page does not drive")
        time.sleep(random.uniform(0.1, 0.2))  # of no fixed phase against its messages
        begun = time.monotonic()
        way.do(scene, tab)
        if way.by_robot:
            _until_it_stands(found, scene, begun)
        else:
            _until_the_safe_command(found, scene, begun)
    finally:
        way.undo(scene)
        if found.paused:
            clock("resume")


def _first(said: Sequence[Said], *, moves: bool, since: float = 0.0) -> Said | None:
    return next((one for one in said if one.moves == moves and one.at >= since), None)


def _until_the_safe_command(found: Found, scene: Scene, begun: float) -> None:
    """Note when the safe command comes, and what comes after it."""
    came = scene.wait(lambda: _first(scene.hand, moves=False, since=begun), LONGEST)
    found.seconds.append(came.at - begun if came else LONGEST)
    if came is None:
        return
    scene.wait(lambda: None, AFTER)
    after = [one for one in scene.hand if one.at > came.at]
    if any(one.moves for one in after):
        found.wrong.append("it was moved again")
    if len(after) > sum(one.moves for one in after):
        found.wrong.append("the safe command came more than once")
    if found.paused:  # and nothing moves when time goes on
        scene.forget()
        scene.fabric.clock("resume")
        if scene.wait(lambda: _first(scene.obeyed, moves=False), LONGEST) is None:
            found.wrong.append("time does not go on")
        elif _first(scene.obeyed, moves=True):
            found.wrong.append("it moved as time went on")


def _until_it_stands(found: Found, scene: Scene, begun: float) -> None:
    """Note when the robot ends the last command; counted from when time goes on."""
    if found.paused:
        time.sleep(random.uniform(0.0, 1.5))
        scene.forget()
        scene.fabric.clock("resume")
        begun = time.monotonic()
    came = scene.wait(lambda: _first(scene.obeyed, moves=False, since=begun), LONGEST)
    found.seconds.append(came.at - begun if came else LONGEST)
    scene.wait(lambda: None, AFTER)
    if came and any(one.moves for one in scene.obeyed if one.at > came.at):
        found.wrong.append("it moved again")


def section(found: Sequence[Found]) -> Section:
    """Return the table for the page."""
    rows: dict[str, list[str]] = {}
    for one in found:
        rows.setdefault(one.way.title, []).extend(one.cells())
    head = ["a person drives, and", "median", "worst", "in time"]
    head += ["paused: median", "worst", "in time"]
    text = """A page in headless Chromium drives a robot by a key that is held down,
or by a stick. Then the person lets go, or something fails. A cell has the seconds of
wall time until the safe command is on the fabric: at most 0.3 s, and published once.
If the page's server is killed, nobody publishes it: the robot itself ends the last
command, within `max_age` + 0.1 s = 0.6 s. While a fabric is paused, ticks do not grow
old, so the page's server counts by its own clock; if it is killed then, the seconds
count from when time goes on. The gamepad is one that a script shows to the page."""
    if (nice := os.nice(0)) != 0:  # on a machine that is busy with other things
        text += f"\nAll these programs ran with priority nice {nice}."
    rest = [[title, *cells] for title, cells in rows.items()]
    return Section(
        "hands", "Seconds until a person's hand lets go", text, table(head, rest)
    )

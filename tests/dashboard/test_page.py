"""The page in a real browser: what a student sees and does, with real robots."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from rems_net.client import join
from rems_net.packing import pack
from tests.agents.runs import PARTS, ticking, until
from tests.commands import Done, command, environment, inside, link_of
from tests.dashboard.browser import Browser, Chromium, page_at

SCRIPT = f"""
from rems_net import Experiment
lab = Experiment("page", dt=0.02, duration="600 s", pace=1, folder={str(PARTS)!r})
lab.input("wave", "parts.py:Wave", host="here")
lab.robot("euler", "parts.py:Cart", "parts.py:Euler", command="input/wave",
    host="here")
lab.robot("bot", "woodbot", "kinematic", host="here")
lab.output("log", "parts.py:Log", host="here")
lab.run("out")
"""
ROBOT = "rems.store.ports.get('robot/euler/state')"
RELEASED = "document.querySelector('#release').hidden"


class Lab:
    """A run in a process of its own, and its page in another."""

    script = SCRIPT

    def __init__(self, folder: Path):
        self.folder = folder
        (folder / "rt").mkdir(mode=0o700)
        (folder / "lab.py").write_text(self.script, encoding="utf-8")
        self._more: dict[str, Any] = {
            "cwd": folder,
            "env": environment(XDG_RUNTIME_DIR=str(folder / "rt")),
            "text": True,
        }
        self._started: list[subprocess.Popen[str]] = []
        try:
            self.link = self._begin(folder)
        except BaseException:
            self.close()
            raise

    def _begin(self, folder: Path) -> str:
        self._run()
        return self.page()

    def _run(self) -> None:
        """Start the run; wait until it ticks."""
        self._started.append(self.start("run", "lab.py"))
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("XDG_RUNTIME_DIR", str(self.folder / "rt"))
            ticking()

    def page(self, *words: str) -> str:
        """Start a page of its own; return its link."""
        page = self.start("dashboard", "--no-qr", *words, stdout=subprocess.PIPE)
        self._started.append(page)
        return link_of(page)

    def start(self, *words: str, **more: Any) -> subprocess.Popen[str]:
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL}
        return subprocess.Popen(command(*words), **(self._more | quiet | more))

    def typed(self, *words: str) -> Done:
        """Type a command, and wait for its end; it is done in this process."""
        there = str(self.folder / "rt")
        return inside(*words, folder=self.folder, XDG_RUNTIME_DIR=there)

    def stopped(self) -> bool:
        """Whether STOP holds, by what `rems` says: not in the process of the page."""
        done = self.typed("list")
        return "STOP holds" in done.stdout + done.stderr

    def ended(self) -> None:
        """Wait for the end of the run."""
        assert self._started[0].wait(30) == 0

    def close(self) -> None:
        for process in reversed(self._started):
            process.terminate()
            process.communicate()


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    with closing(Lab(tmp_path_factory.mktemp("page"))) as made:
        yield made


@pytest.fixture(scope="module")
def tab(lab: Lab, chromium: Chromium) -> Iterator[Browser]:
    ready = f"{ROBOT} && {ROBOT}.tick > 0"
    with page_at(lab.link, chromium, ready) as made:
        yield made


def test_it_shows_values_as_they_change(tab: Browser) -> None:
    tab.until("document.querySelector('#lights').textContent.includes('live')")
    first = tab.run(f"[{ROBOT}.tick, {ROBOT}.number('x')]")
    tab.until(f"{ROBOT}.tick > {first[0]} && {ROBOT}.number('x') != {first[1]}")
    assert tab.run(f"{ROBOT}.row('x').unit") == "m"
    for shown in ("robot/euler", "wheel/left"):
        tab.until(f"document.querySelector('#tree').innerText.includes('{shown}')")
    tab.until("rems.arena.scenes['robot/bot']?.outline?.length > 3")
    tab.until("rems.arena.scenes['robot/bot']?.arena.radius > 0")


def test_a_field_is_plotted_and_its_unit_changed(tab: Browser) -> None:
    field = "document.querySelector('button[title^=\"plot robot/euler/state/x\"]')"
    tab.until(f"!!{field}")
    tab.click(field)
    number = "document.querySelector('figcaption .number').textContent"
    tab.until(f"isFinite(parseFloat({number}))")
    tab.click("document.querySelector('#plot-tools button')")
    tab.until("rems.plots.end !== null && rems.store.t > rems.plots.end + 0.3")
    x = tab.run(f"parseFloat({number})")
    tab.click("document.querySelector('.unit-line button')")
    tab.until("document.querySelector('.unit-line button').textContent == 'cm'")
    tab.until(f"Math.abs(parseFloat({number}) / {x} - 100) < 1")
    tab.click("document.querySelector('#plot-tools button')")
    tab.until("rems.plots.end === null")


def test_the_space_bar_stops_and_a_held_second_releases(lab: Lab, tab: Browser) -> None:
    assert not lab.stopped()
    tab.key(" ", "Space", " ")
    tab.until(
        "document.querySelector('#lights').textContent.includes('2 of 2 robots stand')"
    )
    assert lab.stopped()
    tab.click("document.querySelector('#release')")  # not held
    tab.until(f"{ROBOT}.tick > {tab.run(f'{ROBOT}.tick')} + 15")  # for 0.3 s
    assert lab.stopped()
    tab.click("document.querySelector('#release')", hold=RELEASED)
    assert not lab.stopped()


def test_time_is_paused_and_stepped(tab: Browser) -> None:
    tab.click("document.querySelector('#time button')")
    tab.until("document.querySelector('#lights').textContent.includes('paused')")
    # STOP works with the clock frozen
    tab.click("document.querySelector('#stop')")
    tab.until(
        "document.querySelector('#lights').textContent.includes('2 of 2 robots stand')"
    )
    tab.click("document.querySelector('#release')", hold=RELEASED)
    n = tab.run(f"{ROBOT}.tick")
    tab.click("document.querySelectorAll('#time button')[1]")
    tab.until(f"{ROBOT}.tick == {n} + 1")
    tab.click("document.querySelector('#time button')")
    tab.until(f"{ROBOT}.tick > {n} + 5")


def test_a_thousand_strangers_leave_it_usable(
    lab: Lab, tab: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are present, and answer nothing."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(lab.folder / "rt"))
    tree = "document.querySelector('#tree').innerText"
    with join() as fabric:
        session = fabric.session
        for i in range(1000):
            session.present(session.key("robot", f"g{i}", "@alive"))

        def many() -> bool:
            for i in range(700, 850):
                key = session.key("robot", f"g{i}", "state")
                session.put(key, pack({"x": i / 100}))
            return bool(tab.run(f"{tree}.includes('more agents: search for a name')"))

        until(many)
        tab.run("search.value = 'g777'; search.dispatchEvent(new Event('input'))")
        tab.until(f"{tree}.includes('7.77')")
        tab.click("document.querySelector('#stop')")
        tab.until("document.querySelector('#lights').textContent.includes('STOP')")
        tab.click("document.querySelector('#release')", hold=RELEASED)

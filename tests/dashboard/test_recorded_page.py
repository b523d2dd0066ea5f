"""A recording in the page, in a real browser: played, scrubbed and stepped."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import rems_net
from tests.commands import ROOT, python
from tests.dashboard.browser import Browser, Chromium
from tests.dashboard.recordings import DT, LONG, RESET, page, recording
from tests.pages import blocks

STATE = "rems.store.ports.get('robot/sim/state')"
X = f"{STATE}.history.get('x')"
LIGHTS = "document.querySelector('#lights').textContent"
BAR = "document.querySelector('#playback input[type=range]')"


def button(text: str) -> str:
    return (
        "[...document.querySelectorAll('#playback button')]"
        f".find(one => one.textContent === '{text}')"
    )


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recording(tmp_path_factory.mktemp("monday"))


@pytest.fixture(scope="module")
def opened(file: Path, chromium: Chromium) -> Iterator[tuple[Browser, str]]:
    with page(file.parent) as link, chromium.apart() as made:
        made.size(1280, 800)
        yield made, link.replace("/#", "/?field=robot/sim/state/x#")
        assert made.errors == []


@pytest.fixture
def tab(opened: tuple[Browser, str]) -> Browser:
    made, link = opened
    made.go(link)
    made.until(f"{STATE}?.tick === 1 && {X}?.count === 1")
    return made


def at(tab: Browser, n: int) -> None:
    """Wait until all views are at tick n; a trail and a plot end there."""
    tab.until(
        f"rems.store.tick === {n} && {STATE}.tick === {n} && {X}.count === {n}"
        f" && Math.abs({X}.times[{n - 1}] - {n * DT}) < 1e-9"
    )


def test_it_shows_the_beginning_and_nothing_to_command(tab: Browser) -> None:
    tab.until(f"{LIGHTS}.includes('recording: ')")
    assert "paused" in tab.run(LIGHTS)
    for hidden in ("#stop", "#drive", "#time", ".why", "details > button"):
        seen = f"[...document.querySelectorAll('{hidden}')].filter(e => e.offsetParent)"
        assert tab.run(f"{seen}.length") == 0, hidden
    assert tab.run("rems.arena.scenes['robot/sim'].outline.length") > 3
    assert tab.run("rems.arena.scenes['robot/sim'].arena.radius") > 0
    rows = f"{STATE}.rows.map(row => row.path + ' ' + row.unit).join()"
    assert tab.run(rows) == "x m,y m,heading rad"
    tab.until("document.querySelector('#tree').innerText.includes('lidar/front')")


def test_it_plays_to_its_end_at_any_pace(tab: Browser, file: Path) -> None:
    tab.click(button("play"))
    tab.until(f"rems.store.tick > 5 && {LIGHTS}.includes('plays, pace 1')")
    tab.run("document.querySelector('#playback select').value = '10'; 1")
    tab.run(
        "document.querySelector('#playback select').dispatchEvent(new Event('change'))"
    )
    tab.until(f"{LIGHTS}.includes('plays, pace 10') || rems.store.t === {LONG}")
    tab.until(f"{LIGHTS}.includes('paused')")
    at(tab, round(LONG / DT))  # every value of the plot, at pace 10
    shown = tab.run(f"[...{X}.values.slice(0, {X}.count)]")
    want = np.asarray(rems_net.read(file)["sim"]["state/x"], np.float32)
    assert np.array_equal(np.array(shown, np.float32), want)
    tab.click(button("play"))  # once more from the beginning
    tab.until(f"rems.store.t < {LONG} / 2 && {X}.count < 120")


def test_all_views_follow_a_jump_ahead_and_back(tab: Browser) -> None:
    log = "document.querySelector('#log').innerText"
    tab.click(BAR)  # its middle
    tab.until("Math.abs(rems.store.t - 2.5) < 0.1")
    at(tab, tab.run("rems.store.tick"))
    assert tab.run("rems.plots.window()[1] === rems.store.t")
    x, y = tab.place(BAR)
    tab.mouse("mousePressed", x, y)
    for far in (60, 120, 180, 240):
        tab.mouse("mouseMoved", x + far, y, buttons=1)
    tab.mouse("mouseReleased", x + 240, y)
    tab.until(f"rems.store.tick > {RESET}")
    tab.until(f"{log}.includes('tick {RESET + 1}, robot/sim: called from outside')")
    at(tab, tab.run("rems.store.tick"))
    tab.run("rems.playback.jump(1.0)")
    at(tab, 50)
    assert "called" not in tab.run(log)
    text = "document.querySelector('#played').textContent"
    tab.until(f"{text} === '1.00 s of 5.00 s, tick 50'")


def test_keys_play_step_and_scrub(tab: Browser) -> None:
    tab.run("rems.playback.jump(1.0)")
    at(tab, 50)
    tab.key("ArrowRight", "ArrowRight")
    at(tab, 51)
    for n in (50, 49):
        tab.key("ArrowLeft", "ArrowLeft")
        at(tab, n)
    tab.until(f"Math.abs({BAR}.value - {49 * DT}) < 1e-9")  # it is drawn there
    tab.run(f"{BAR}.focus()")
    tab.key("ArrowRight", "ArrowRight")
    at(tab, 50)
    tab.send("Input.dispatchKeyEvent", type="keyDown", key="End", code="End")
    tab.send(
        "Input.dispatchKeyEvent",
        type="keyDown",
        key="End",
        code="End",
        windowsVirtualKeyCode=35,
    )
    at(tab, round(LONG / DT))
    tab.key(" ", "Space", " ")
    tab.until(f"{LIGHTS}.includes('plays') && rems.store.t < {LONG} / 2")
    tab.key(" ", "Space", " ")
    tab.until(f"{LIGHTS}.includes('paused')")


def test_a_field_that_is_plotted_later_has_its_past(tab: Browser) -> None:
    tab.run("rems.playback.jump(2.0)")
    at(tab, 100)
    tab.until("document.querySelector('#tree').innerText.includes('gyro/z')")
    tab.click(
        "document.querySelector('button[title^=\"plot robot/sim/sensors/gyro\"]')"
    )
    tab.until(
        "rems.store.ports.get('robot/sim/sensors').history.get('gyro/z').count === 100"
    )


def test_any_pace_is_typed(tab: Browser) -> None:
    free = "document.querySelector('#playback input[type=number]')"
    tab.run(f"{free}.focus(); {free}.select()")
    tab.send("Input.insertText", text="0.3")
    tab.send(
        "Input.dispatchKeyEvent",
        type="keyDown",
        key="Enter",
        code="Enter",
        text="\r",
        windowsVirtualKeyCode=13,
    )
    tab.until("rems.playback.pace === 0.3")


def test_robots_of_a_second_recording_are_ghosts(
    tmp_path: Path, chromium: Chromium
) -> None:
    """As the page on the page has it."""
    here = ROOT / "docs" / "dashboard.md"
    (tmp_path / "two.py").write_text(blocks(here, "python")[0], encoding="utf-8")
    assert python(tmp_path, "two.py").returncode == 0
    *_, line = next(b for b in blocks(here, "sh") if "tuesday" in b).splitlines()
    words = [tmp_path / one for one in line.split()[2:]]
    with page(*words) as link, chromium.apart() as tab:
        tab.go(link)
        tab.until(f"{STATE}?.tick === 1")
        ghost = "robot/sim (tuesday)"
        tab.run("rems.playback.jump(1.0)")
        tab.until(f"rems.store.ports.get('{ghost}/state')?.tick === 50")
        assert tab.run("[...rems.arena.ghosts(rems.arena.robots())].join()") == ghost
        apart = tab.run(
            f"rems.store.ports.get('{ghost}/state').number('heading')"
            f" - {STATE}.number('heading')"
        )
        assert apart == pytest.approx(0.5, abs=1e-6)
        assert not tab.run("rems.store.ports.has('input/curve (tuesday)/value')")
        assert tab.errors == []


def test_a_file_that_is_cut_off_is_shown_up_to_there(
    tmp_path: Path, file: Path, chromium: Chromium
) -> None:
    data = file.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: len(data) * 3 // 5])
    with page(cut) as link, chromium.apart() as tab:
        tab.go(link)
        log = "document.querySelector('#log').innerText"
        tab.until(f"{log}.includes('cut.mcap has no end')")
        tab.until(f"{LIGHTS}.includes('cut off')")
        end = tab.run("rems.playback.recording.end")
        assert 1 < end < LONG
        tab.run(f"rems.playback.jump({LONG})")
        tab.until(f"Math.abs(rems.store.t - {end}) < 1e-9")

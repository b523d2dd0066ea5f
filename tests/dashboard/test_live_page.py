"""The page in a real browser: layouts, settings that change, held ticks, the doctor."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from rems_net.agents.about.outside import Outside
from rems_net.client import join
from rems_net.recordings.mcap.reader import McapFile
from tests.agents.runs import until
from tests.dashboard import test_page
from tests.dashboard.browser import Browser, Chromium, page_at

TUNED = (Path(__file__).parents[1] / "engine").as_posix()
HOLDER = """
import time
from pathlib import Path
from rems_net import In, Process


class Holder(Process):
    cart = In()

    def step(self, tick):
        while Path("hold").exists():
            time.sleep(0.05)  # here it holds the tick
"""
SCRIPT = f"""
from rems_net import Experiment
lab = Experiment("live", dt=0.02, duration="600 s", pace=1)
lab.input("swing", "{TUNED}/tuned.py:Swing", host="here")
cart = "{TUNED}/tuned.py:Cart"
lab.robot("cart", cart, "kinematic", command="input/swing", host="here")
lab.process("holder", "holder.py:Holder", cart="robot/cart/state")
lab.run("out")
"""
LIGHTS = "document.querySelector('#lights').textContent"
SLIDER = "document.querySelector('input[aria-label=\"gain of input/swing\"]')"


class Lab(test_page.Lab):
    """A run with settings that change, and a process that can hold its ticks."""

    script = SCRIPT

    def __init__(self, folder: Path):
        (folder / "holder.py").write_text(HOLDER, encoding="utf-8")
        super().__init__(folder)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    with closing(Lab(tmp_path_factory.mktemp("live"))) as made:
        yield made


@pytest.fixture(scope="module")
def tab(lab: Lab, chromium: Chromium) -> Iterator[Browser]:
    ready = "rems.store.ports.get('robot/cart/state')?.tick > 0"
    with page_at(lab.link, chromium, ready) as made:
        yield made


def opened(tab: Browser, agent: str) -> None:
    """Open the settings of an agent, as a hand does."""
    table = f"document.querySelector('table[aria-label=\"settings of {agent}\"]')"
    tab.until(f"!!{table}")
    if not tab.run(f"{table}.parentElement.open"):
        tab.run(f"{table}.previousSibling.focus()")
        tab.key("Enter", "Enter", "\r")
    tab.until(f"{table}.rows.length > 0")


def test_a_slider_changes_a_setting_and_a_rerun_knows(lab: Lab, tab: Browser) -> None:
    opened(tab, "input/swing")
    tab.until(f"!!{SLIDER}")
    assert tab.run(f"[{SLIDER}.type, {SLIDER}.min, {SLIDER}.max, {SLIDER}.value]") == [
        *("range", "0", "2", "0.5")
    ]
    # a text is listed, and cannot be changed
    assert not tab.run("!!document.querySelector('[aria-label^=\"title of\"]')")
    tab.run(f"{SLIDER}.focus()")
    for _ in range(3):
        tab.send(
            "Input.dispatchKeyEvent",
            type="keyDown",
            key="ArrowRight",
            code="ArrowRight",
            windowsVirtualKeyCode=39,
        )
    cell = f"{SLIDER}.closest('tr').querySelector('.value').textContent"
    tab.until(f"{cell} === '0.53'")
    swing = "rems.store.ports.get('input/swing/value').number('speed')"
    tab.run(f"{SLIDER}.value = 0; {SLIDER}.dispatchEvent(new Event('input'))")
    tab.until(f"{swing} === 0.1")  # the rest alone
    opened(tab, "robot/cart")
    tab.run("rems.bar.ask('adjust', {agent: 'robot/cart', values: {factor: 7}})")
    tab.until("document.querySelector('#log').innerText.includes('factor')")
    tab.key(" ", "Space", " ")  # STOP, also while a slider has the focus
    tab.until(f"{LIGHTS}.includes('STOP holds')")
    tab.click(
        "document.querySelector('#release')",
        hold="document.querySelector('#release').hidden",
    )
    tab.until("document.querySelector('#release').hidden")


def test_a_layout_is_saved_and_loaded(lab: Lab, tab: Browser) -> None:
    folder = lab.folder / "saved"
    folder.mkdir()
    allowed = {"behavior": "allow", "downloadPath": str(folder)}
    tab.send("Browser.setDownloadBehavior", browserContextId=tab.context, **allowed)
    tab.run("rems.plots.toggle('robot/cart/state/x')")
    tab.click("document.querySelector('.unit-line button')")
    tab.until("document.querySelector('.unit-line button').textContent === 'cm'")
    tab.run("rems.plots.show(30)")
    tab.click("document.querySelector('button[title^=\"save plots\"]')")
    file = folder / "layout.json"
    until(file.exists)
    assert json.loads(file.read_text()) == {
        "layout": 1,
        "span": 30,
        "plots": [{"field": "robot/cart/state/x", "unit": "cm"}],
        "arena": None,
    }
    tab.run("rems.plots.clear(); rems.plots.show(10)")
    node = tab.send("DOM.getDocument")["root"]["nodeId"]
    for name, sentence in (("holder.py", "no layout of a page"), ("", "")):
        path = lab.folder / name if name else file
        given = tab.send("DOM.querySelector", nodeId=node, selector="#layout")
        tab.send("DOM.setFileInputFiles", files=[str(path)], nodeId=given["nodeId"])
        if sentence:
            tab.until(
                f"document.querySelector('#log').innerText.includes('{sentence}')"
            )
    tab.until("rems.plots.series.length === 1 && rems.plots.span === 30")
    tab.until("document.querySelector('.unit-line button').textContent === 'cm'")
    tab.go(lab.page("--layout", str(file)))  # a page that begins with it
    tab.until("rems.plots.series.length === 1 && rems.plots.span === 30")
    tab.until("document.querySelector('.unit-line button')?.textContent === 'cm'")
    tab.go(lab.link)
    tab.until("rems.store.ports.get('robot/cart/state')?.tick > 0")
    refused = lab.typed("dashboard", "--layout", "holder.py")
    assert refused.returncode == 2
    assert "holder.py cannot be read as a layout: it is no JSON" in refused.stderr


DRAWN = """
(async () => {
  const { History } = await import('./store.js');
  const { store, plots } = rems;
  const port = store.ports.get('robot/cart/state');
  plots.clear();
  for (let i = 0; i < 4; i++) {
    port.rows.push({ path: `made/${i}`, dtype: 'float', unit: ['m', 'rad'][i % 2] });
    const points = new History();
    for (let n = 0; n < 30_000; n++) points.add(n / 50, Math.sin(n / 300 + i) + n % 7);
    port.history.set(`made/${i}`, points);
    plots.toggle(`robot/cart/state/made/${i}`);
  }
  plots.show(600);
  plots.hold(600);
  plots.draw();
})()
"""


def test_four_long_series_are_drawn_in_four_milliseconds(tab: Browser) -> None:
    """By the processor's time of the page's thread: other programs do not count."""
    tab.run(DRAWN)
    tab.send("Performance.enable", timeDomain="threadTicks")

    def worked() -> float:
        found = tab.send("Performance.getMetrics")["metrics"]
        return float(next(o["value"] for o in found if o["name"] == "TaskDuration"))

    tab.run("for (let i = 0; i < 100; i++) rems.plots.draw()")  # compiled by now
    before = worked()
    tab.run("for (let i = 0; i < 200; i++) rems.plots.draw()")
    ms = 1000 * (worked() - before) / 200
    print(f"{ms:.2f} ms for each drawing of four series of 30,000 points")
    assert ms <= 4.0
    tab.run(
        "rems.plots.clear(); rems.plots.hold(null); rems.plots.show(10);"
        "rems.store.ports.get('robot/cart/state').rows.splice(-4)"
    )


def test_the_doctor_examines_the_connection(tab: Browser) -> None:
    tab.run("document.querySelector('#doctor summary').focus()")
    tab.key("Enter", "Enter", "\r")
    tab.until("document.querySelector('#doctor').innerText.includes('has one clock')")
    assert not tab.run("!!document.querySelector('#doctor .bad')")
    tab.run("document.querySelector('#doctor').open = false")


def test_it_names_the_line_that_holds_the_tick(lab: Lab, tab: Browser) -> None:
    line = HOLDER.splitlines().index(
        "            time.sleep(0.05)  # here it holds the tick"
    )
    (lab.folder / "hold").touch()
    try:
        tab.until(f"{LIGHTS}.includes('held by process/holder')")
        tab.until(f"{LIGHTS}.includes('holder.py, line {line + 1}')")
    finally:
        (lab.folder / "hold").unlink()
    tab.until(f"{LIGHTS}.includes('live')")


def test_what_was_changed_is_in_the_recording(lab: Lab, tab: Browser) -> None:
    """The last one of this file: it ends the run."""
    tab.run("rems.bar.ask('adjust', {agent: 'input/swing', values: {gain: 0}})")
    tab.until("rems.store.ports.get('input/swing/value').number('speed') === 0.1")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(lab.folder / "rt"))
        with join() as fabric:
            fabric.clock("end")
    lab.ended()
    found = [
        (key, call)
        for _, key, text in McapFile(lab.folder / "out" / "run.mcap").events()
        if (call := Outside.read(text)) is not None
    ]
    assert ("input/swing", "adjust") in [(key, call.verb) for key, call in found]
    assert any(call.kwargs == {"gain": 0} for _, call in found)

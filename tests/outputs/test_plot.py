"""The output plot: a window that no tick waits for."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from threading import Event as Timer

import pytest

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.tick import Tick
from rems_net.errors import AgentError
from rems_net.events import Event, listening
from rems_net.outputs.plot import WAITING, PlotOutput, _Window
from tests.agents.runs import Told, until
from tests.commands import ROOT

#: a pixel of a line, as a display has it: blue, green, red
LINE = bytes((0xB4, 0x77, 0x1F))
LINES = ["robot/sim/state/x", "robot/sim/state/heading", "input/keys/value/wheel/left"]


def lab(**more: object) -> Experiment:
    made = Experiment("shown", dt="50 ms", duration="1 s", folder=ROOT / "examples")
    made.input("keys", "csv", options={"file": "keys.csv"}, host=HERE)
    made.robot("sim", "woodbot", "kinematic", command="input/keys", host=HERE)
    made.output("figure", "plot", options=more)
    return made


@pytest.fixture
def display(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Path]:
    """A display that nobody sees: the file of its picture, of 4 bytes a pixel."""
    if shutil.which("Xvfb") is None:
        pytest.skip("There is no Xvfb here, a display that nobody sees")
    pytest.importorskip("tkinter", reason="There is no tkinter here, for windows")
    read, write = os.pipe()
    words = ["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24"]
    words += ["-fbdir", str(tmp_path)]
    server = subprocess.Popen(words, pass_fds=[write], stderr=subprocess.DEVNULL)
    try:
        os.close(write)
        with os.fdopen(read, encoding="ascii") as pipe:
            monkeypatch.setenv("DISPLAY", f":{pipe.readline().strip()}")
        yield tmp_path / "Xvfb_screen0"
    finally:
        server.terminate()
        server.wait()


def test_without_a_display_one_sentence_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    heard: list[Event] = []
    with listening(heard.append), lab().engine(tmp_path / "run") as engine:
        engine.run()
    (one,) = (event for event in heard if event.kind == "display")
    assert one.text == (
        "output/figure: there is no display here, so no figure is shown; `rems plot` "
        "draws the recording"
    )
    assert (tmp_path / "run" / "run.mcap").is_file()


def test_a_field_that_nobody_has_is_refused_before_the_start(tmp_path: Path) -> None:
    wrong = lab(fields=["robot/sim/state/z"])
    with pytest.raises(AgentError) as caught:
        wrong.run(tmp_path / "run", direct=True)
    assert str(caught.value).startswith(
        "output/figure: there is no number 'robot/sim/state/z' to be drawn; expected "
        "such as input/keys/value/wheel/left, "
    )
    assert not [*tmp_path.rglob("*.mcap")]


def test_a_window_that_takes_nothing_delays_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The newest values wait, and no more than these."""
    monkeypatch.setattr(sys, "executable", shutil.which("cat") or sys.executable)
    window = _Window({"title": "cat ends at once: there is no file -m"})
    assert until(lambda: window.put([0.0]))
    for n in range(3 * WAITING):
        window.put([float(n)])
    assert len(window._rows) <= WAITING
    assert window._rows[-1] == [3.0 * WAITING - 1]
    window.close()


class Slow(PlotOutput):
    """A figure that takes 0.1 s for each of its ticks, and notes them."""

    def write(self, tick: Tick) -> None:
        with (self.out / "ticks.txt").open("a", encoding="ascii") as file:
            print(tick.n, file=file)
        Timer().wait(0.1)


def test_a_run_does_not_wait_for_a_figure(tmp_path: Path) -> None:
    """It leaves out the ticks that it is too slow for; the recording has all."""
    made = lab()
    del made.plans["output/figure"]
    made.output("figure", Slow)
    made.output("log", "csv")
    made.duration = 20.0
    result = made.run(tmp_path / "run")
    ticks = (tmp_path / "run" / "ticks.txt").read_text(encoding="ascii").split()
    assert result.ticks == len(result["sim"]["state/x"]) == 400 > len(ticks) > 0


@pytest.mark.parametrize("fields", [[], LINES])
def test_the_window_draws_to_the_end_of_its_rows(
    display: Path, fields: list[str]
) -> None:
    """And then it ends, without a complaint."""
    pytest.importorskip("matplotlib", reason="There is no matplotlib here")
    names = fields or ["robot/sim/state/x", "robot/sim/state/y"]
    units = ["m", "rad", "rad/s"][: len(names)] if fields else ["m", "m"]
    head = {"title": "t", "names": names, "units": units, "paths": not fields}
    rows = [[0.1 * n, *(float(n * k) for k in range(len(names)))] for n in range(9000)]
    done = subprocess.run(
        [sys.executable, "-m", "rems_net.outputs.window", json.dumps(head)],
        input="".join(json.dumps(row) + "\n" for row in rows),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stdout.strip()) == (0, ""), done


def test_the_figure_grows_while_the_run_goes_on(display: Path, tmp_path: Path) -> None:
    """Someone at the display sees new pictures, and each tick is at its time."""
    pytest.importorskip("matplotlib", reason="There is no matplotlib here")
    seen: set[bytes] = set()

    def watch(clock: Clock) -> None:
        def new() -> bool:
            picture = display.read_bytes()
            if picture.count(LINE) > 100:
                seen.add(sha256(picture).digest())
            return len(seen) > 5

        until(new, 60)
        clock.pacing.end()

    made = lab(fields=LINES)
    made.duration, told = 300.0, Told(watch)
    result = made.run(tmp_path / "run", pace=1, show=told)
    assert len(seen) == 6
    assert 5 < result.ticks == len(result["sim"]["state/x"])
    assert not told.of("display")


def test_a_run_with_a_window_has_the_same_values(display: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="There is no matplotlib here")
    for name, made in (("shown", lab(fields=LINES)), ("plain", lab())):
        if name == "plain":
            del made.plans["output/figure"]
        made.output("log", "csv")
        made.run(tmp_path / name, direct=True)
    both = [(tmp_path / name / "sim.csv").read_bytes() for name in ("shown", "plain")]
    assert both[0] == both[1]

"""The pictures of docs/dashboard.md: `python -m tests.dashboard.pictures`."""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

from PIL import Image

from tests.commands import ROOT, command, link_of, python
from tests.dashboard.browser import Browser, browser
from tests.dashboard.recordings import page as opened
from tests.pages import blocks

SCRIPT = """
from rems_net import Experiment, Input, Out, Schema, Settings, Tick, sin
from rems_net.units import number, percent


class Weave(Input):
    options = Settings(phase=number())
    value = Out(Schema("weave", {"wheel/left": percent(), "wheel/right": percent()}))

    def read(self, tick: Tick):
        swing = 12 * sin(1.5 * tick.t + self.options.phase)
        return {"wheel/left": 30 + swing, "wheel/right": 30 - swing}


lab = Experiment("hall", dt="20 ms", duration="600 s", pace=1)
lab.world(
    "hall",
    options={
        "size": [2.4, 1.6],
        "walls": [
            {"start": [0.2, -0.8], "end": [0.2, -0.2]},
            {"start": [-0.6, 0.3], "end": [0.0, 0.6]},
        ],
        "boxes": [
            dict(name="crate", size=[0.12, 0.12, 0.08], x=0.55, y=0.12, mass=0.05),
            dict(name="shelf", size=[0.5, 0.1, 0.2], x=-0.8, y=-0.6),
        ],
        "balls": [dict(name="ball", radius=0.05, x=-0.2, y=-0.4, mass=0.02)],
        "cylinders": [dict(name="drum", radius=0.07, height=0.15, x=0.8, y=-0.4)],
    },
)
robots = {"alice": ("woodbot", -0.9, 0.1), "bob": ("woodbot", 0.35, 0.1)}
robots["carol"] = ("epuck", 0.6, -0.55)
for i, (name, (kind, x, y)) in enumerate(robots.items()):
    lab.input(f"hand_{name}", Weave, options={"phase": i}, host="hands")
    lab.robot(
        name,
        kind,
        "mujoco",
        world="hall",
        command=f"input/hand_{name}",
        initial={"x": x, "y": y},
    )
lab.run()
"""
#: two recordings in one page: a time, and what is plotted
TIME = 4.0
BOTH = "?field=robot/sim/state/x&field=robot/sim%20(tuesday)/state/x"
FIELDS = "?field=robot/alice/state/x&field=robot/bob/state/x"
FIELDS += "&field=robot/alice/state/heading"


def main() -> None:
    live()
    recorded()


def recorded() -> None:
    """Make the picture of two recordings, by the blocks of the page."""
    page = ROOT / "docs" / "dashboard.md"
    with tempfile.TemporaryDirectory() as folder:
        there = Path(folder)
        (there / "two.py").write_text(blocks(page, "python")[0], encoding="utf-8")
        python(there, "two.py")
        both = there / "runs/monday", there / "runs/tuesday"
        with opened(*both) as link, browser(there) as tab:
            tab.size(1280, 800)
            tab.go(link.replace("/#", f"/{BOTH}#"))
            tab.until("rems.store.tick > 0")
            tab.run(f"rems.playback.jump({TIME})")
            tab.until(f"Math.abs(rems.store.t - {TIME}) < 0.01")
            drawn = tab.run("rems.cost.frames")
            tab.until(f"rems.cost.frames > {drawn} + 30")  # so that all is drawn
            kept(tab, ROOT / "docs/dashboard_recorded.png")


def kept(tab: Browser, file: Path) -> None:
    """Write what is to be seen, in 256 colours: half as many bytes."""
    tab.picture(file)
    Image.open(file).convert("RGB").quantize(256).save(file, optimize=True)


def live() -> None:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "hall.py").write_text(SCRIPT, encoding="utf-8")
        run = subprocess.Popen(
            command("run", "hall.py", "--dashboard"),
            cwd=folder,
            env={**os.environ, "XDG_RUNTIME_DIR": folder},
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            link = link_of(run)
            with browser(Path(folder)) as tab:
                tab.size(1280, 800)
                tab.go(link.replace("/#", f"/{FIELDS}#"))
                tab.until("rems.store.t > 0")
                # so that the plots are full
                tab.until(f"rems.store.t > {tab.run('rems.store.t')} + 11")
                kept(tab, ROOT / "docs/dashboard.png")
                tab.size(360, 740, dark=True)
                tab.key(" ", "Space", " ")
                tab.until("document.body.innerText.includes('3 of 3 robots stand')")
                tab.until(f"rems.store.t > {tab.run('rems.store.t')} + 1")
                kept(tab, ROOT / "docs/dashboard_small.png")
        finally:
            run.terminate()
            run.communicate()


if __name__ == "__main__":
    main()

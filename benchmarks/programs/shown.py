"""What the programs that measure the page share: a run of kinematic Woodbots."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

from rems_net import join
from rems_net.client import Fabric
from rems_net.errors import FabricError

NAME = "shown"
SCRIPT = """
from rems_net import Experiment
lab = Experiment("{name}", dt="20 ms", duration="9 h", pace={pace!r}, fabric="{name}")
for i in range({robots}):
    lab.robot(f"r{{i}}", "woodbot", "kinematic", host="robots")
lab.run("out")
"""
#: s. A run begins within this time.
START_TIMEOUT = 60.0


def began(stack: ExitStack, robots: int, pace: float | str = 1) -> tuple[Fabric, Path]:
    """Start a run at 50 Hz of fabric time; return its fabric and its folder.

    pace: the speed of real time, or "fast". It ends with the stack.
    """
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
    # a runtime folder of its own, in which no other run is found
    os.environ["XDG_RUNTIME_DIR"] = str(folder)
    text = SCRIPT.format(name=NAME, pace=pace, robots=robots)
    (folder / "lab.py").write_text(text, encoding="utf-8")
    started(stack, folder, "lab.py")
    end = time.monotonic() + START_TIMEOUT
    while time.monotonic() < end:
        try:
            fabric = join(NAME)
            if len(fabric.agents()) >= robots:
                return stack.enter_context(fabric), folder
            fabric.session.close()
        except FabricError:
            pass
        time.sleep(0.1)
    raise SystemExit("the run does not begin")


def started(stack: ExitStack, folder: Path, *words: str) -> subprocess.Popen[str]:
    """Start a Python program there; return it. It ends with the stack."""
    process = subprocess.Popen(
        [sys.executable, *words],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    stack.callback(process.communicate)
    stack.callback(process.terminate)
    return process

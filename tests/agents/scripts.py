"""Scripts as a student writes them, each run by a Python of its own."""

import os
import subprocess
import sys
from pathlib import Path

from tests.agents.runs import quiet
from tests.commands import ROOT

#: said by a second run of one name
MOVED = "[run] what was in "

#: a driver of a Woodbot, up to where it says something
HAND = """\
import atexit, gzip, random, sys, time
from rems_net import Experiment, In, Input, Out, Output, Process, Schema, Settings
from rems_net.defdict import number, percent

VALUE = Schema("hand", {"wheel": {"left": percent(), "right": percent()}})


"""
#: the experiment that it is in, alone in its process
LAB = """
lab = Experiment("lab", duration="1 s", record=False)
lab.input("hand", Hand)
lab.robot("sim", "woodbot", "kinematic", command="input/hand", host="here")
lab.output("log", "csv", host="here")
"""
#: the same, where it is about the driver alone
ALONE = """
lab = Experiment("lab", duration="1 s")
lab.input("hand", Hand)
"""


def script(folder: Path, text: str, *words: str, typed: str = "") -> tuple[int, str]:
    """Run it as `python lab.py`: its exit status, and all that it prints."""
    (folder / "lab.py").write_text(text, encoding="utf-8")
    return python(folder, "lab.py", *words, typed=typed)


def python(folder: Path, *words: str, typed: str = "") -> tuple[int, str]:
    """Run `python` with these words, in the same way.

    Without what a busy machine says by itself: held ticks, lost real time.
    """
    done = subprocess.run(
        [sys.executable, "-W", "error", *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        input=typed,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=60,
        check=False,
    )
    lines = quiet(done.stdout).splitlines(keepends=True)
    return done.returncode, "".join(line for line in lines if MOVED not in line)

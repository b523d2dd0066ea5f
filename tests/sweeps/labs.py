"""Experiments to be swept, and sweeps in processes of their own."""

from __future__ import annotations

import shutil
from pathlib import Path

from rems_net import Experiment
from rems_net.sweeps.swept import Swept

PARTS = Path(__file__).with_name("swept.py")
LAB = """
[experiment]
name = "weave"
dt = "50 ms"
duration = "{duration}"

[[input]]
name = "weave"
type = "swept.py:Weave"

[[robot]]
name = "sim"
definition = "swept.py:Cart"
driver = "kinematic"
command = "input/weave"

[[process]]
name = "trouble"
type = "swept.py:Trouble"

[[output]]
name = "log"
type = "csv"
"""


def written(folder: Path, duration: str = "1 s") -> Path:
    """Write an experiment and its agents there; return its file."""
    folder.mkdir(exist_ok=True)
    shutil.copy(PARTS, folder / "swept.py")
    path = folder / "lab.toml"
    path.write_text(LAB.format(duration=duration))
    return path


def lab(folder: Path, duration: str = "1 s") -> Experiment:
    """Return the same experiment."""
    written(folder)
    made = Experiment("weave", dt="50 ms", duration=duration, folder=folder)
    made.input("weave", "swept.py:Weave")
    made.robot("sim", "swept.py:Cart", "kinematic", command="input/weave")
    made.process("trouble", "swept.py:Trouble")
    made.output("log", "csv")
    return made


def content(swept: Swept) -> dict[str, bytes]:
    """Return all files of a sweep, by their names."""
    paths = sorted(path for path in swept.folder.rglob("*") if path.is_file())
    return {p.relative_to(swept.folder).as_posix(): p.read_bytes() for p in paths}

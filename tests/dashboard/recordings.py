"""Recordings for the page, and the page on them in a process of its own."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rems_net import Experiment, Input, Out, Tick, Woodbot
from tests.commands import command, environment, link_of

#: s. Length of a tick, and of a recording.
DT, LONG = 0.02, 5.0
#: tick after which the robot was put back to its start
RESET = 150


class Curve(Input):
    """Both wheels forwards, one of them faster."""

    value = Out(Woodbot.command)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"wheel/left": 3.0, "wheel/right": 4.0}


def recording(folder: Path, name: str = "lab", **initial: Any) -> Path:
    """Record a robot that drives a curve for 5 s; after 3 s it is put back."""
    lab = Experiment(name, dt=DT, duration=LONG)
    lab.input("curve", Curve)
    lab.robot("sim", "woodbot", "kinematic", command="input/curve", initial=initial)
    lab.output("recorder", "mcap")
    with lab.engine(folder) as engine:
        engine.step(RESET)
        engine["robot/sim"].reset()
        engine.step(round(LONG / DT) - RESET)
    return folder / "run.mcap"


@contextmanager
def page(*words: str | Path) -> Iterator[str]:
    """Start `rems dashboard` with these words; yield its link."""
    typed = command("dashboard", "--no-qr", *map(str, words))
    process = subprocess.Popen(
        typed,
        env=environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        encoding="utf-8",
    )
    try:
        yield link_of(process)
    finally:
        process.terminate()
        process.communicate()

"""A class of machines: a router on `hub`, and laptops, each with a user of its own."""

from __future__ import annotations

import hashlib
import time

from tests.reliability.rig.programs import Program
from tests.reliability.rig.rig import Rig

#: links as in a class, and far worse
WIFI = {"delay": 0.02, "jitter": 0.01, "loss": 0.02}
WORSE = {"delay": 0.1, "jitter": 0.08, "loss": 0.1}
#: seconds for what takes a second where nothing else is to do
SOON = 60.0
LAB = """
[experiment]
name = "lab"
dt = "50 ms"
duration = "{duration} s"
wait = {{ back = "{back} s" }}
pace = {pace}

[[input]]
name = "keys"
type = "csv"
options.file = "keys.csv"

[[robot]]
name = "one"
definition = "woodbot"
driver = "kinematic"
command = "input/keys"

[[robot]]
name = "two"
definition = "woodbot"
driver = "kinematic"
command = "input/keys"
machine = "b"

[[output]]
name = "log"
type = "csv"
"""


class Lab(Rig):
    """Machines, and what people type there. Use it by `with`; links are made in it."""

    machines = ("hub", "a", "b", "c")

    def build(self) -> Lab:
        """Make the machines."""
        self.connect(*self.machines)
        return self

    def file(
        self, *, duration: float = 10, back: float = 30, pace: object = '"fast"'
    ) -> str:
        """Write the experiment; everybody has it."""
        rows = [f"{n / 2},{0.1 * (n % 7)},{0.2 * (n % 5)}" for n in range(1, 2001)]
        head = "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]"
        (self.folder / "keys.csv").write_text("\n".join([head, *rows, ""]), "utf-8")
        text = LAB.format(duration=duration, back=back, pace=pace)
        (self.folder / "lab.toml").write_text(text, encoding="utf-8")
        return "lab.toml"

    def serve(self, *words: str, machine: str = "hub") -> Program:
        """Open a fabric on the hub, and wait until it is there."""
        served = self.rems("router", "serve", *words, machine=machine)
        served.wait_for("^Open fabric", SOON)
        return served

    def zoe(self, machine: str = "a", router: str = "") -> Program:
        """A robot of an open fabric."""
        words = "agent", "start", "robot", "woodbot", "kinematic", "--name", "zoe"
        return self.rems(*words, machine=machine, router=router)

    def says(self, machine: str, *words: str, router: str = "", status: int = 0) -> str:
        """What a command prints there, once it has ended with this status."""
        done = self.rems(*words, machine=machine, router=router)
        ended = done.process.wait(SOON)
        assert ended == status, f"rems {' '.join(words)}: {ended}\n{done.text()}"
        return done.text()

    def run_and_bring(self, router: str, out: str = "here") -> tuple[Program, Program]:
        """The run on `a`, with `robot/two` brought from `b`."""
        words = ("run", "lab.toml", "--out", out)
        run = self.rems(*words, machine="a", router=router)
        run.wait_for("fabric at", SOON)
        program = "tests.agents.bringing"
        bring = self.module(program, "b", machine="b", router=router)
        return run, bring

    def rows(self, out: str = "here", robot: str = "two") -> int:
        """How many rows the recording of this robot has by now."""
        path = self.folder / out / f"{robot}.csv"
        return max(0, path.read_bytes().count(b"\n") - 1) if path.exists() else 0

    def digest(self, out: str) -> str:
        """Of all that was recorded."""
        total = hashlib.sha256()
        for path in sorted((self.folder / out).glob("*.csv")):
            total.update(path.name.encode() + path.read_bytes())
        return total.hexdigest()

    def wait(self, seconds: float) -> None:
        """Let wall time pass: what is under test is what happens meanwhile."""
        time.sleep(seconds)

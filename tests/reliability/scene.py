"""Scene: a driven robot that moves, with all that keeps it moving, in one of 3 places.

alone   a run with a router of its own, all on this machine
same    a router, and a run that uses it, on this machine
apart   four machines: the router on `hub`; the clock, and another robot, on `lab`; the
        commander on `desk`; the driven robot on `bot`
"""

import json
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from tests.reliability.rig.programs import Program, until
from tests.reliability.rig.rig import HERE, Rig
from tests.reliability.robots import CART, ROBOTS, WHEELS

PLACES = ("alone", "same", "apart")
#: the period of ticks, s
DT = 0.05
LAB = """
[experiment]
name = "{name}"
dt = {dt}
duration = 3600
pace = 1.0
"""
COMMANDER = """
[[input]]
name = "commander"
type = "{parts}:{type}"
{desk}
"""
RELAY = """
[[process]]
name = "relay"
type = "{parts}:Relay"
heard_from = "input/commander"
"""
OTHER = """
[[robot]]
name = "other"
definition = "{definition}"
driver = "{parts}:Model"
{command}
"""
DRIVEN = """
[[robot]]
name = "driven{i}"
definition = "{definition}"
driver = "{driver}"
{command}
host = "driven-{host}"
{options}
{bot}
"""


#: the robot of a run elsewhere, in a fabric of its own, that commands the driven one
AWAY = """
[[robot]]
name = "remote"
definition = "{definition}"
driver = "{parts}:Elsewhere"
command = "input/commander"
options = {{ key = "{key}" }}
"""


#: who commands: the type of the input, and what the robots read; "" for a program
#: that is no part of the experiment
COMMANDERS = {
    "lock-step": ("Commander", "input/commander"),
    "free-running": ("FreeCommander", "input/commander"),
    "relayed": ("FreeCommander", "process/relay"),
    "outside": ("", ""),
    "remote": ("", ""),
}


@dataclass(frozen=True, slots=True)
class Change:
    """A robot began to move, or stands still, since `at` (CLOCK_MONOTONIC, s)."""

    robot: int
    at: float
    moves: bool
    why: str


class Scene:
    """Use it by `with`, inside a rig that has nothing in it yet."""

    def __init__(
        self,
        rig: Rig,
        place: str,
        *,
        robots: int = 1,
        hosts: int = 1,
        commander: str = "lock-step",
        robot: str = "cart",
    ):
        self.rig, self.place, self.robots, self.hosts = rig, place, robots, hosts
        self.commander = commander
        self.tried = ROBOTS[robot]
        self.folder = rig.folder
        self.out = self.folder / "out"
        self._log = self.folder / "device.jsonl"
        self.endpoint = ""
        #: when a fault began, where that is not just before it was asked for
        self.begun = 0.0
        #: a program that stops the driven robot's host, once there is one
        self.debugger: Program
        self._tellers: dict[str, Program] = {}
        self._changes: list[Change] = []
        self._read = 0
        self.apart = place == "apart"
        self.hub, self.lab, self.desk, self.bot = (
            ("hub", "lab", "desk", "bot") if self.apart else (HERE,) * 4
        )

    def __enter__(self) -> Self:
        rig = self.rig
        rig.__enter__()
        try:
            self._build()
        except BaseException:
            rig.__exit__(*sys.exc_info())
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.rig.__exit__()

    def _build(self) -> None:
        rig = self.rig
        if self.apart:
            rig.connect(self.hub, self.lab, self.desk, self.bot)
        self._file = self.folder / "lab.toml"
        self._file.write_text(self._text(self._devices()), encoding="utf-8")
        if self.place != "alone":
            self.router, self.endpoint = rig.router(self.hub)
        run = ("run", self._file, "--out", self.out)
        self.run = rig.rems(*run, machine=self.lab, router=self.endpoint)
        if self.apart:
            desk = [self.desk] if COMMANDERS[self.commander][0] else []
            for machine in (*desk, self.bot):
                rig.module(
                    "tests.agents.bringing",
                    *(machine, self.folder),
                    machine=machine,
                    router=self.endpoint,
                )
        if self.commander == "outside":
            self._command_from_outside()
        elif self.commander == "remote":
            until(lambda: self._at("robot/driven0").exists(), "the robot", 40.0)
            self._command_from_a_run("rems/robot/driven0")
        self.wait_until_moving(40.0)

    def _devices(self) -> list[str]:
        """Start the devices, and return their ports."""
        kind = self.tried.emulated
        program = "emulated" if kind else "device"
        words = (kind,) if kind else ("--robots", self.robots)
        self.device = self.rig.module(
            f"tests.reliability.programs.{program}",
            *(self._log, *words),
            machine=self.bot,
        )
        told = json.loads(self.device.wait_for("^{.*").group())
        ports: list[str] = told["ports"]
        return ports

    def _text(self, ports: Sequence[str]) -> str:
        """The experiment, as a file."""
        kind, source = COMMANDERS[self.commander]
        tried = self.tried
        told: dict[str, object] = {
            "parts": tried.parts,
            "definition": tried.definition,
            "driver": tried.driver,
            "command": f'command = "{source}"' if source else "",
            "desk": "",
            "bot": "",
        }
        if self.apart:
            ports = [*map(self._brought, ports)]
            told = {k: self._beside(v) for k, v in told.items()}
            told |= {"desk": 'machine = "desk"', "bot": 'machine = "bot"'}
        parts = [LAB.format(name="lab", dt=DT)]
        if kind:
            parts.append(COMMANDER.format(type=kind, **told))
        if self.commander == "relayed":
            parts.append(RELAY.format(**told))
        parts.append(OTHER.format(**told))
        for i, port in enumerate(ports):
            options = f'options = {{ {tried.where} = "{port}" }}' if tried.where else ""
            host = i % self.hosts
            parts.append(DRIVEN.format(i=i, options=options, host=host, **told))
        return "".join(parts)

    def _beside(self, named: object) -> str:
        """Return a name of classes; their file is copied beside the experiment."""
        name = str(named)
        for file in (CART, WHEELS):
            text = file.read_text("utf-8")
            text = text.replace("from tests.reliability import parts", "import parts")
            (self.folder / file.name).write_text(text, "utf-8")
            name = name.replace(str(file), file.name)
        return name

    def _brought(self, port: str) -> str:
        """Return the name of a port that a laptop lets another one use."""
        return os.path.realpath(port) if Path(port).exists() else port

    def _command_from_outside(self) -> None:
        endpoint = self.endpoint
        if not endpoint:
            note = until(
                lambda: next(self.rig.runtime.rglob("rems-*.json"), None), "a run", 40.0
            )
            endpoint = json.loads(note.read_text(encoding="utf-8"))["endpoint"]
        self.outsider = self.rig.module(
            "tests.reliability.programs.outside",
            *(endpoint, "rems/robot/driven0/command", self.tried.command),
            machine=self.desk,
        )

    def _command_from_a_run(self, key: str) -> None:
        """Start a run of its own, with its own router if this one is alone."""
        told = {"parts": self.tried.parts, "definition": self.tried.definition}
        away = self.folder / "away.toml"
        commander = COMMANDER.format(type="Commander", desk="", **told)
        lab = LAB.format(name="away", dt=DT)
        away.write_text(lab + commander + AWAY.format(key=key, **told), "utf-8")
        out = self.folder / "away"
        words = ("run", str(away), "--fabric", "away", "--out", str(out))
        self.away = self.rig.rems(*words, machine=self.desk, router=self.endpoint)

    def tell(self, module: str, *words: str, machine: str = "") -> Program:
        """Start a program that talks to this fabric, on `lab` unless told."""
        return self.rig.module(
            module, *words, machine=machine or self.lab, router=self.endpoint
        )

    def clock(self, word: str, fabric: str = "rems") -> None:
        """Tell the clock `pause`, or `stop`; it begins when that is sent."""
        if fabric not in self._tellers:
            teller = self.tell("tests.reliability.programs.tell", fabric)
            teller.wait_for("ready")
            self._tellers[fabric] = teller
        self.begun = float(self._tellers[fabric].ask(word))

    # -- looking at it -------------------------------------------------------------

    def pid(self, agent: str) -> int:
        """The process in which an agent lives, such as `robot/other`."""
        return int(self._at(agent).read_text(encoding="utf-8"))

    def _at(self, agent: str) -> Path:
        """Where it says so: on another machine in the folder of what it makes there."""
        name = f"{agent.replace('/', '-')}.pid"
        for folder in (self.folder, self.folder / "away"):
            if (folder / name).exists():
                return folder / name
        found = (self.folder / "runs").glob(f"lab-*/{name}")
        return next(found, self.out / name)

    def changes(self) -> list[Change]:
        """All that the device has told, in order."""
        for told in map(json.loads, self._new_lines()):
            change = Change(
                told["robot"], told["monotonic"], told["moves"], told["why"]
            )
            self._changes.append(change)
        return self._changes

    def _new_lines(self) -> list[str]:
        """Return what the device has logged since, in whole lines."""
        with self._log.open("rb") as log:
            log.seek(self._read)
            new = log.read()
        whole = new[: new.rfind(b"\n") + 1]
        self._read += len(whole)
        return whole.decode().splitlines()

    def moving(self) -> set[int]:
        """The robots that move now."""
        last = {change.robot: change.moves for change in self.changes()}
        return {robot for robot, moves in last.items() if moves}

    def wait_until_moving(self, seconds: float) -> None:
        """Wait until every robot moves. Raises TimeoutError."""

        def look() -> bool:
            for program in self.rig.programs:
                if program.ended and program.name == "rems_net":
                    raise RuntimeError(f"{program.log.name}:\n{program.text()}")
            return len(self.moving()) == self.robots

        until(look, f"{self.robots} moving robots", seconds)

    def stood_still(self, robot: int, begun: float, end: float) -> tuple[float, str]:
        """How long after `begun` it last moved before `end`, and what stopped it.

        Infinite for one that moved at `end`; 0 for one that stood still all along.
        """
        last = Change(robot, begun, False, "never moved")
        for change in self.changes():
            if change.robot == robot and change.at <= end:
                last = change
        if last.moves:
            return float("inf"), "nothing"
        return max(0.0, last.at - begun), last.why

    def sleep(self, seconds: float) -> None:
        """Let wall time pass: what is under test is what happens meanwhile."""
        time.sleep(seconds)

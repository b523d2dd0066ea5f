"""What faults do to a run over machines, and to what it had recorded."""

import re
import signal
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tests.network.lab import Lab
from tests.reliability.page import Section, table
from tests.reliability.rig.programs import Program, send, until

#: seconds that things are frozen, and that a router is away
FROZEN, AWAY = 10.0, 2.0
#: seconds that a member may be out of sight where the run shall end
SHORT = 3.0
#: seconds for what goes on, or ends, on a busy machine
GIVE_UP = 90.0
TICK = 50


class Scene:
    """A run in real time on `a`, with a robot that was brought from `b`."""

    def __init__(self, lab: Lab, **settings: float):
        self.lab, self.settings = lab, settings
        self.router, self.endpoint = lab.router("hub")
        lab.file(duration=8, pace=1, back=settings.get("back", 30))
        file = lab.folder / "lab.toml"
        text = file.read_text("utf-8")
        if "restart" in settings:
            text = text.replace('name = "two"', 'name = "two"\nrestart = 1')
        file.write_text(text, "utf-8")
        self.run, self.bring = lab.run_and_bring(self.endpoint)
        until(lambda: lab.rows() > TICK, f"{TICK} rows", GIVE_UP)
        #: when the fault was over, or happened, where it never is; and the rows then
        self.begun, self.rows = 0.0, 0

    def over(self) -> None:
        """From now on it is to go on."""
        self.begun, self.rows = time.monotonic(), self.lab.rows()

    def pid(self, agent: str) -> int:
        """The process of an agent."""
        said = self.lab.says("c", "list", router=self.endpoint)
        found = re.search(rf"^{agent} .*:(\d+) ", said, re.MULTILINE)
        assert found, said
        return int(found[1])

    def kept(self) -> dict[str, bytes]:
        """What is in the recordings now."""
        folder = self.lab.folder / "here"
        return {path.name: path.read_bytes() for path in folder.glob("*.csv")}

    def frozen(self, *pids: int) -> None:
        """Freeze these processes for a while."""
        for pid in pids:
            send(pid, signal.SIGSTOP)
        self.lab.wait(FROZEN)
        self.over()
        for pid in pids:
            send(pid, signal.SIGCONT)

    def killed(self, *pids: int) -> None:
        for pid in pids:
            send(pid, signal.SIGKILL)
        self.over()

    def router_away(self) -> None:
        self.router.kill()
        self.lab.wait(AWAY)
        self.over()
        self.lab.router("hub", self.endpoint)

    def machine_gone(self) -> None:
        """As if its battery was empty: not even the system says goodbye."""
        self.lab.cut("b")
        self.killed(*self.lab.machine("b"))

    def clock_gone(self) -> None:
        self.killed(self.run.pid)


@dataclass(frozen=True)
class Row:
    """A fault, and what the run is expected to do."""

    title: str
    do: Callable[[Scene], None]
    #: "goes on", "ends"
    then: str = "goes on"
    settings: dict[str, float] = field(default_factory=dict)
    #: whether the recording shall be that of a run without a fault
    same: bool = True


ROWS = [
    Row("an agent killed", lambda s: s.killed(s.pid("robot/one")), "ends"),
    Row(
        "an agent of another machine killed",
        lambda s: s.killed(s.pid("robot/two")),
        "ends",
        {"back": SHORT},
    ),
    Row(
        "an agent killed, with `restart = 1`",
        lambda s: s.killed(s.pid("robot/two")),
        settings={"restart": 1},
        same=False,
    ),
    Row("the clock killed", Scene.clock_gone, "ends", {"back": SHORT}),
    Row(f"the router killed, and back {AWAY:g} s later", Scene.router_away),
    Row("a whole machine gone", Scene.machine_gone, "ends", {"back": SHORT}),
    Row("an agent frozen for 10 s", lambda s: s.frozen(s.pid("robot/two"))),
    Row("the clock frozen for 10 s", lambda s: s.frozen(s.run.pid)),
    Row("the router frozen for 10 s", lambda s: s.frozen(s.router.pid)),
    Row("a whole machine frozen for 10 s", lambda s: s.frozen(*s.lab.machine("b"))),
]


@dataclass
class Found:
    """What the trials of one row showed. seconds: until it went on, or had ended."""

    title: str
    then: str
    seconds: list[float] = field(default_factory=list)
    kept: list[bool] = field(default_factory=list)
    same: list[bool] = field(default_factory=list)
    said: str = ""

    def cells(self) -> list[str]:
        worst = f"{max(self.seconds):.1f}" if self.seconds else ""
        median = f"{statistics.median(self.seconds):.1f}" if self.seconds else ""
        same = ("yes" if all(self.same) else "NO") if self.same else ""
        kept = "yes" if all(self.kept) else "NO"
        trials = str(len(self.kept))
        return [self.title, self.then, median, worst, trials, kept, same, self.said]


def measure(
    rows: Sequence[Row],
    trials: int,
    folder: Path,
    tell: Callable[[str], None] = lambda line: None,
) -> list[Found]:
    """Do it so many times."""
    with Lab(folder / "expected") as lab:
        _, router = lab.build().router("hub")
        lab.file(duration=8)
        lab.says("a", "run", "lab.toml", "--alone", "--out", "alone", router=router)
        expected = {p.name: p.read_bytes() for p in lab.folder.glob("alone/*.csv")}
    found = []
    for i, row in enumerate(rows):
        found.append(Found(row.title, row.then))
        for trial in range(trials):
            with Lab(folder / f"{i}-{trial}") as lab:
                lab.build()
                _try(row, Scene(lab, **row.settings), found[-1], expected)
        tell(" | ".join(found[-1].cells()))
    return found


def _try(row: Row, scene: Scene, found: Found, expected: dict[str, bytes]) -> None:
    before = scene.kept()
    row.do(scene)
    if row.then == "goes on":
        # Who was killed may have left a row on its way.
        rows = scene.rows + row.settings.get("restart", 0)
        until(lambda: scene.lab.rows() > rows, "another row", GIVE_UP)
        found.seconds.append(time.monotonic() - scene.begun)
        statuses = [program.process.wait(GIVE_UP) for program in _both(scene)]
        assert statuses == [0, 0], [program.text() for program in _both(scene)]
        if row.same:
            found.same.append(scene.kept() == expected)
    else:
        found.seconds.append(_ended(scene) - scene.begun)
        scene.bring.process.wait(GIVE_UP)
    after = scene.kept()
    found.kept.append(
        all(after[name].startswith(rows) for name, rows in before.items())
        and all(whole(rows) for rows in after.values())
    )
    found.said = found.said or _said(scene)


def _both(scene: Scene) -> list[Program]:
    return [scene.run, scene.bring]


def _ended(scene: Scene) -> float:
    """When the last process of the machine with the clock was gone."""
    scene.run.process.wait(GIVE_UP)
    until(lambda: not scene.lab.machine("a"), "the end of all hosts", GIVE_UP)
    return time.monotonic()


def whole(content: bytes) -> bool:
    """Whether every line of a recording has an end, and as many cells."""
    lines = content.splitlines(keepends=True)
    columns = {line.count(b",") for line in lines}
    return len(columns) == 1 and all(line.endswith(b"\n") for line in lines)


def _said(scene: Scene) -> str:
    """The sentence that matters most; where the clock is dead, on the other machine."""
    told = [] if scene.run.process.wait() < 0 else scene.run.text().splitlines()
    wanted = (
        [line for line in told if line.startswith("rems: ") and "Ended" not in line][1:]
        or [line for line in told if "crashed" in line]
        or [line for line in told if " late: " in line]
    )
    if not wanted:
        wanted = [x for x in scene.bring.text().splitlines() if "warning" in x][-1:]
    line = re.sub(r"^(rems: |\[\S+\] )(warning: )?", "", (wanted or [""])[0])
    return re.sub(r"tcp/[\d.:]+", "...", line)


def served_again(folder: Path, trials: int) -> Found:
    """An open fabric, killed with its router, and served again."""
    found = Found(f"`rems router serve` killed, and back {AWAY:g} s later", "goes on")
    here = "^robot/zoe on a is here$"
    for trial in range(trials):
        with Lab(folder / str(trial)) as lab:
            served = lab.build().serve()
            lab.zoe(router="tcp/10.77.0.1:7447")
            served.wait_for(here, GIVE_UP)
            served.kill()
            lab.wait(AWAY)
            begun = time.monotonic()
            lab.serve().wait_for(here, GIVE_UP)
            found.seconds.append(time.monotonic() - begun)
            found.kept.append(True)
    return found


HEAD = ["fault", "the run", "median [s]", "worst [s]", "trials", "kept", "same bytes"]
HEAD += ["what it says"]
TEXT = f"""A lock-step run in real time, 20 ticks a second: the clock, an input, a
robot and the output on one machine, another robot on a second, the router on a third.
After {TICK} rows the fault comes. The seconds are from its end until the next row is
recorded, or until no process of the run is left on the clock's machine. *Kept*: all
that was recorded before is there, in whole rows. *Same bytes*: the recording is that
of a run without a fault. `wait` was {{ back = "{SHORT:g} s" }}. A full disk, few files
and the system's time are those of a run on one machine. For `rems router serve` the
seconds count until its agent is there again."""


def section(found: Sequence[Found]) -> Section:
    """What docs/measured/reliability.md says."""
    lines = table(HEAD, [one.cells() for one in found])
    return Section("faults", "Faults, and what was recorded", TEXT, lines)

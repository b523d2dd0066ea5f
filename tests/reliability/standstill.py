"""How many seconds of wall time after a fault a driven robot stands still."""

from __future__ import annotations

import random
import signal
import statistics
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from tests.reliability.page import Section, table
from tests.reliability.rig.programs import send
from tests.reliability.rig.rig import Rig
from tests.reliability.scene import PLACES, Scene

#: seconds for which a command may be old, and what the fabric may take on top
MAX_AGE, MARGIN = 0.5, 0.1
LIMIT = MAX_AGE + MARGIN
#: seconds after the end of a fault in which a run that goes on moves its robot again
BACK = 8.0


@dataclass(frozen=True)
class Fault:
    """What `do` brings about at once, and `undo` ends, if it ends."""

    do: Callable[[Scene], None]
    undo: Callable[[Scene], None] | None = None


@dataclass(frozen=True)
class Row:
    """A fault, and what is watched while it `lasts` [s]."""

    title: str
    fault: Fault
    lasts: float = 3.0
    places: Sequence[str] = PLACES
    commander: str = "lock-step"
    #: seconds after which it must stand
    limit: float = LIMIT


@dataclass
class Found:
    """What the trials of one row in one place showed, in seconds."""

    row: Row
    place: str
    seconds: list[float] = field(default_factory=list)
    stopped_by: list[str] = field(default_factory=list)
    back: int = 0

    @property
    def worst(self) -> float:
        return max(self.seconds)

    def cells(self) -> list[str]:
        """One line of the table."""

        def show(value: float) -> str:
            return f"{value:.2f}" if value < self.row.lasts else f"> {self.row.lasts:g}"

        by = ", ".join(sorted(set(self.stopped_by)))
        kept = "yes" if self.worst <= self.row.limit else "**no**"
        count = len(self.seconds)
        back = f"{self.back} of {count}" if self.row.fault.undo else ""
        middle = show(statistics.median(self.seconds))
        title = self.row.title
        return [title, self.place, show(self.worst), middle, str(count), kept, by, back]


def _signal(agent: str, sign: signal.Signals) -> Callable[[Scene], None]:
    return lambda scene: send(scene.pid(agent), sign)


def _killed(agent: str) -> Fault:
    return Fault(_signal(agent, signal.SIGKILL))


def _frozen(agent: str) -> Fault:
    return Fault(_signal(agent, signal.SIGSTOP), _signal(agent, signal.SIGCONT))


def _router_back(scene: Scene) -> None:
    scene.router, _ = scene.rig.router(scene.hub, scene.endpoint)


def _late(way: Fault) -> Fault:
    """Words that were said while the way was shut, and come when they are 2 s old.

    The commander is frozen meanwhile, so nothing newer comes. What begins is that the
    way is open again: a robot that moves then obeys what is too old.
    """

    def do(scene: Scene) -> None:
        assert way.undo is not None
        way.do(scene)
        scene.sleep(1.0)
        send(scene.pid(COMMANDER), signal.SIGSTOP)
        scene.sleep(2.0)
        scene.begun = time.monotonic()
        way.undo(scene)

    return Fault(do, _signal(COMMANDER, signal.SIGCONT))


def _hold(scene: Scene) -> None:
    (scene.out / "hold").touch()


def _go_on(scene: Scene) -> None:
    (scene.out / "hold").unlink()


def _cut(which: str) -> Fault:
    return Fault(lambda s: s.rig.cut(getattr(s, which)), lambda s: s.rig.heal())


def _cut_one_way(scene: Scene) -> None:
    scene.rig.cut(scene.hub, scene.bot, one_way=True)


APART, ROUTED = ("apart",), ("same", "apart")
DRIVEN = "robot/driven0"
COMMANDER, OTHER, DRIVEN = "input/commander", "robot/other", "robot/driven0"
ROUTER_FROZEN = Fault(lambda s: s.router.freeze(), lambda s: s.router.thaw())
ROWS = [
    Row("the commander frozen", _frozen(COMMANDER)),
    Row("the commander killed", _killed(COMMANDER)),
    Row("the commander cut off", _cut("desk"), places=APART),
    Row(
        "a free-running commander frozen, ticks go on",
        _frozen(COMMANDER),
        commander="free-running",
    ),
    Row(
        "the same, and a process says its words again",
        _frozen(COMMANDER),
        commander="relayed",
    ),
    Row(
        "a program outside, that commands, frozen",
        Fault(lambda s: s.outsider.freeze(), lambda s: s.outsider.thaw()),
        commander="outside",
    ),
    Row(
        "a program outside, that commands, killed",
        Fault(lambda s: s.outsider.kill()),
        commander="outside",
    ),
    Row("another lock-step robot frozen", _frozen(OTHER)),
    Row("a tick held by a robot's code", Fault(_hold, _go_on)),
    Row(
        "the clock paused",
        Fault(lambda s: s.clock("pause"), lambda s: s.clock("resume")),
    ),
    Row("the clock frozen", Fault(lambda s: s.run.freeze(), lambda s: s.run.thaw())),
    Row("the clock killed", Fault(lambda s: s.run.kill())),
    Row("the router frozen", ROUTER_FROZEN, places=ROUTED),
    Row("the router killed", Fault(lambda s: s.router.kill()), places=ROUTED),
    Row(
        "the router restarted after 2 s",
        Fault(lambda s: s.router.kill(), _router_back),
        lasts=2.0,
        places=ROUTED,
    ),
    Row("the network cut for 8 s", _cut("hub"), lasts=8.0, places=APART),
    Row("the robot's machine cut for 30 s", _cut("bot"), lasts=30.0, places=APART),
    Row(
        "the way to the robot's machine cut",
        Fault(_cut_one_way, lambda s: s.rig.heal()),
        places=APART,
    ),
    Row(
        "words come 2 s late: the router was frozen",
        _late(ROUTER_FROZEN),
        places=ROUTED,
        commander="free-running",
        limit=0.0,
    ),
    Row(
        "words come 2 s late: the robot's machine was cut off",
        _late(_cut("bot")),
        places=APART,
        commander="free-running",
        limit=0.0,
    ),
    Row("the robot's host frozen", _frozen(DRIVEN)),
    Row("the robot's host killed", _killed(DRIVEN)),
]


def measure(
    rows: Sequence[Row],
    places: Sequence[str],
    trials: int,
    folder: Path,
    tell: Callable[[str], None] = lambda line: None,
    jobs: int = 1,
) -> list[Found]:
    """Try each row in each of its places so many times, `jobs` rows at a time."""
    found = [
        Found(row, place) for place in places for row in rows if place in row.places
    ]

    def work(i: int) -> None:
        _try(found[i], trials, folder / f"{found[i].place}-{i}")
        tell(" | ".join(found[i].cells()))

    with ThreadPoolExecutor(jobs) as pool:
        for done in [pool.submit(work, i) for i in range(len(found))]:
            done.result()
    return found


def _try(found: Found, trials: int, folder: Path) -> None:
    """Make trials, in one scene as long as it recovers, else in new ones."""
    attempt = 0
    while len(found.seconds) < trials:
        attempt += 1
        if attempt > 2 * trials + 2:
            raise RuntimeError(f"{found.row.title}, {found.place}: its robot stands")
        rig = Rig(folder / str(attempt))
        with Scene(rig, found.place, commander=found.row.commander) as scene:
            while len(found.seconds) < trials and _once(found, scene):
                pass


def _once(found: Found, scene: Scene) -> bool:
    """One trial; whether the robot moves again, so that there can be another one."""
    row = found.row
    # A while of moving, of no fixed phase against the ticks.
    scene.sleep(random.uniform(0.5, 0.7))
    if not scene.moving():  # what the fault before has left behind
        return False
    before = time.monotonic()
    scene.begun = 0.0
    row.fault.do(scene)
    begun = scene.begun or before
    scene.sleep(max(0.0, begun + row.lasts - time.monotonic()))
    seconds, why = scene.stood_still(0, begun, begun + row.lasts)
    found.seconds.append(seconds)
    found.stopped_by.append(why)
    if row.fault.undo is None:
        return False
    row.fault.undo(scene)
    try:
        scene.wait_until_moving(BACK)
    except (TimeoutError, RuntimeError):
        return False
    found.back += 1
    return True


HEAD = ["fault", "place", "worst", "median", "trials", "kept", "stopped by", "again"]
TEXT = f"""A robot behind a serial line (a pseudo-terminal), whose device moves in wall
time and has a watchdog of its own (0.5 s), was told 0.5 m/s at every tick, 20 times a
second. Then came the fault. How many seconds of wall time later did it stand still?
The limit is `max_age` + {MARGIN} s = {LIMIT} s. `alone`: one run with its own router;
`same`: a router of its own process, same machine; `apart`: router, clock, commander and
robot on four machines. *Stopped by*: `told` (by its driver), `watchdog` (the
device's own) or nothing, as long as the fault lasted. *Again*: in how many trials it
moved again within {BACK:g} s after the end of a fault that ends. Where words come late,
what counts is from when the way is open again, and it must not move at all."""


def section(found: Sequence[Found]) -> Section:
    """What docs/reliability.md says."""
    lines = table(HEAD, [one.cells() for one in found])
    return Section(
        "standstill", "Seconds until a driven robot stands still", TEXT, lines
    )

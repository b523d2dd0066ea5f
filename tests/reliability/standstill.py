"""How many seconds of wall time after a fault a driven robot stands still."""

from __future__ import annotations

import random
import statistics
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from tests.reliability.firmware import FirmwareScene
from tests.reliability.page import Section, table
from tests.reliability.rig.rig import Rig
from tests.reliability.robots import ROBOTS
from tests.reliability.rows import LIMIT, MARGIN, Row
from tests.reliability.scene import Scene

#: the robot of the first table, and the one that is a member of the fabric itself
CART, FIRMWARE = "cart", "woodbot"
#: seconds after the end of a fault in which a run that goes on moves its robot again
BACK = 8.0


@dataclass
class Found:
    """What the trials of one row in one place showed, in seconds."""

    row: Row
    place: str
    robot: str = CART
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
        title, place = self.row.title, self.place
        if self.robot != CART:
            place = f"{ROBOTS[self.robot].title}, {place}"
        return [title, place, show(self.worst), middle, str(count), kept, by, back]


def measure(
    rows: Sequence[Row],
    places: Sequence[str],
    trials: int,
    folder: Path,
    tell: Callable[[str], None] = lambda line: None,
    jobs: int = 1,
    robot: str = CART,
) -> list[Found]:
    """Try each row in each of its places so many times, `jobs` rows at a time."""
    found = [
        Found(row, place, robot)
        for place in places
        for row in rows
        if place in row.places
    ]

    def work(i: int) -> None:
        _try(found[i], trials, folder / f"{robot}-{found[i].place}-{i}")
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
        row = found.row
        scene = FirmwareScene if found.robot == FIRMWARE else Scene
        made = scene(rig, found.place, commander=row.commander, robot=found.robot)
        with made:
            while len(found.seconds) < trials and _once(found, made):
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


DEVICES = f"""The same faults, and the drivers that ship, each with an emulator of its
device. A Dynabot's servos have a watchdog of their own. A Create 2 and the first
firmware of the Woodbot have none: a process of its own holds their port
([how](hardware.md#a-device-without-a-watchdog)), and counts as *told*. The Woodbot's
own firmware is on an open fabric, without a host, and commanded by a program outside.
The limit is {LIMIT} s again."""


def devices(found: Sequence[Found]) -> Section:
    """What docs/reliability.md says of the robots of a class."""
    lines = table(["fault", "robot", *HEAD[2:]], [one.cells() for one in found])
    return Section("devices", "The same for the devices of a class", DEVICES, lines)


def section(found: Sequence[Found]) -> Section:
    """What docs/reliability.md says."""
    lines = table(HEAD, [one.cells() for one in found])
    return Section(
        "standstill", "Seconds until a driven robot stands still", TEXT, lines
    )

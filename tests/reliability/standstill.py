"""How many seconds of wall time after a fault a driven robot stands still."""

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

    def cell(self) -> str:
        """Return the worst time of a page's table, and the number of trials."""
        count = len(self.seconds)
        worst = f"{self.worst:.2f}"
        if self.worst >= self.row.lasts:
            worst = f"> {self.row.lasts:g}"
        if self.worst > self.row.limit:
            worst = f"**{worst}**"
        mark = " w" if "watchdog" in self.stopped_by else ""
        back = ""
        if self.row.fault.undo and self.back < count:
            back = f", moved again in {self.back}"
        return f"{worst}{mark} ({count}{back})"

    def cells(self) -> list[str]:
        """Return all that was found, for the screen."""

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


#: columns of the two tables, after the fault
ROUTERS = {
    "alone": "its own router",
    "same": "a router beside it",
    "apart": "four machines",
}
TEXT = f"""A robot behind a serial line (a pseudo-terminal) gets a command at every
tick, 20 times a second. Then a fault comes. A cell has the seconds of wall time until
the robot stands, in the worst of so many trials. The limit is `max_age` + {MARGIN} s
= {LIMIT} s. The device has a watchdog of 0.5 s: `w` marks faults after which it
stopped the robot, and not the driver. After each fault that ended the robot moved
again within {BACK:g} s, in all trials but those that a cell names. Late commands must
not move the robot."""


DEVICES = f"""The same faults, with the drivers that ship and emulated devices. Servos
of a Dynabot have a watchdog of their own. A Create 2 and the first firmware of the
Woodbot have none: [another process holds their
port](../hardware.md#a-device-without-a-watchdog). The Woodbot's own firmware is on an
open fabric, and a program commands it. The limit is {LIMIT} s."""


def _table(found: Sequence[Found], columns: dict[str, str], robots: bool) -> str:
    """One row for each fault, one column for each place or robot."""
    rows: dict[str, dict[str, str]] = {}
    for one in found:
        column = one.robot if robots else one.place
        rows.setdefault(one.row.title, {})[column] = one.cell()
    lines = [
        [title, *(row.get(name, "") for name in columns)] for title, row in rows.items()
    ]
    return table(["fault", *columns.values()], lines)


def devices(found: Sequence[Found]) -> Section:
    """Return the section of measured/reliability.md on the robots of a class."""
    columns = {name: robot.title for name, robot in ROBOTS.items() if robot.emulated}
    lines = _table(found, columns, robots=True)
    return Section("devices", "The same for the devices of a class", DEVICES, lines)


def section(found: Sequence[Found]) -> Section:
    """Return the section of measured/reliability.md on one robot in three places."""
    lines = _table(found, ROUTERS, robots=False)
    return Section(
        "standstill", "Seconds until a driven robot stands still", TEXT, lines
    )

"""How long it takes from STOP until the last of thirty robots stands still."""

import random
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tests.reliability.page import Section, table
from tests.reliability.rig.programs import until
from tests.reliability.rig.rig import Rig
from tests.reliability.scene import Scene

ROBOTS, HOSTS = 30, 3
#: what class Wi-Fi is like, each way between the router and everybody
WIFI = {"delay": 0.02, "jitter": 0.01, "loss": 0.02}
#: seconds in which the last one stands, in 99 of 100
GOAL = 0.25
#: seconds after which a robot that still moves was not stopped
GIVE_UP = 5.0
#: seconds for which they must go on standing still, to count
STANDS = 0.3


@dataclass
class Found:
    """Seconds until the last one stood, per trial; infinite if one never did."""

    network: str
    seconds: list[float] = field(default_factory=list)

    def share(self, part: float) -> float:
        """The value that this share of the trials does not exceed."""
        ordered = sorted(self.seconds)
        return ordered[min(len(ordered) - 1, int(part * len(ordered)))]

    def cells(self) -> list[str]:
        def show(value: float) -> str:
            gone_on = value == float("inf")
            return f"> {GIVE_UP * 1000:.0f}" if gone_on else f"{value * 1000:.0f}"

        kept = "yes" if self.share(0.99) <= GOAL else "**no**"
        figures = [show(self.share(p)) for p in (0.5, 0.99, 1.0)]
        return [self.network, *figures, str(len(self.seconds)), kept]


def measure(
    trials: int,
    folder: Path,
    *,
    place: str = "apart",
    wifi: bool = False,
    robots: int = ROBOTS,
    tell: Callable[[str], None] = lambda line: None,
) -> Found:
    """STOP so many times, with a release in between."""
    network = "20 +/- 10 ms, 2 % loss" if wifi else "no delay, no loss"
    found = Found(f"{place}, {network}")
    scene = Scene(Rig(folder), place, robots=robots, hosts=min(HOSTS, robots))
    with scene:
        teller = scene.tell("tests.reliability.programs.tell", machine=scene.desk)
        teller.wait_for("ready")
        if wifi:
            scene.rig.link(scene.hub, "*", **WIFI)
        for _ in range(trials):
            scene.wait_until_moving(30.0)
            scene.sleep(random.uniform(0.2, 0.3))
            scene.wait_until_moving(30.0)
            begun = float(teller.ask("stop"))
            found.seconds.append(_last(scene, begun))
            teller.ask("release")
    tell(" | ".join(found.cells()))
    return found


def _last(scene: Scene, begun: float) -> float:
    """When the last one stood still, for good; infinite if one never did."""

    def all_stand() -> bool:
        if scene.moving():
            return False
        last = max(change.at for change in scene.changes())
        return time.monotonic() - last > STANDS

    try:
        until(all_stand, "standing still", GIVE_UP + STANDS)
    except TimeoutError:
        return float("inf")
    last = max(change.at for change in scene.changes())
    return max(0.0, last - begun)


HEAD = ["where", "p50 [ms]", "p99 [ms]", "worst [ms]", "trials", "p99 in goal"]
TEXT = f"""{ROBOTS} driven robots in {HOSTS} hosts on one router, each behind a serial
line, get a command 20 times a second. The time is from the moment before a program on
another machine puts STOP, until the last robot stands still and goes on standing for
{STANDS} s. The goal is {GOAL * 1000:.0f} ms for 99 of 100. Delay and loss are those
of each link to the router, one way; a STOP takes two of them."""


def section(found: Sequence[Found]) -> Section:
    """What docs/measured/reliability.md says."""
    lines = table(HEAD, [one.cells() for one in found])
    return Section("stop", "STOP: until the last of thirty robots stands", TEXT, lines)

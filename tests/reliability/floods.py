"""Floods and frozen watchers: what they change for a run that is none of theirs."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.agents.runs import digest
from tests.reliability.page import Section, table
from tests.reliability.rig.programs import Program
from tests.reliability.rig.rig import HERE, Rig
from tests.reliability.robots import CART as PARTS

#: ms by which a flood may delay a paced run
LIMIT = 50.0
RATE, SECONDS = 10_000, 5.0
#: keys that a run listens to, and some that nobody does; {} is a new one each time
KEYS = [
    "rems/clock/@step/tick",
    "rems/clock/@step/roster",
    "rems/clock/@step/done",
    "rems/clock/tick",
    "rems/stop",
    "rems/input/commander/@step/value",
    "rems/input/commander/value",
    "rems/robot/other/command",
    "rems/robot/other/state",
    "rems/robot/other/{}",
    "rems/{}/state",
    "other/clock/tick",
]
#: 0xc1 is no msgpack at all; an empty map is, and says nothing; text, where numbers are
PAYLOADS = {"no msgpack": "c1000000", "an empty map": "80", "text": "a568656c6c6f"}
LAB = """
[experiment]
name = "lab"
dt = {dt}
duration = {duration}
pace = {pace}

[[input]]
name = "commander"
type = "{parts}:Commander"

[[robot]]
name = "other"
definition = "{parts}:Cart"
driver = "{parts}:Model"
command = "input/commander"

[[output]]
name = "log"
type = "csv"
host = "out"

[[output]]
name = "lateness"
type = "{parts}:Lateness"
host = "out"
"""


@dataclass(frozen=True)
class Told:
    """What a run left: its recordings' digest, and how late its ticks came [ms].

    late: of the latest tick, after the earliest    spent: from first to last [s]
    flood: what the flood said of itself    ended: the run's exit status
    """

    what: str
    recordings: str
    rows: int
    late: float
    median: float
    spent: float
    flood: str
    ended: int

    def cells(self, quiet: Told) -> list[str]:
        same = "yes" if self.recordings == quiet.recordings else "**no**"
        more = f"{self.late - quiet.late:+.0f}"
        figures = [f"{self.late:.0f}", more, f"{self.median:.1f}", f"{self.spent:.1f}"]
        return [self.what, same, str(self.rows), *figures, self.flood]


class Lab:
    """A run beside which something happens: all on this machine, or on three."""

    def __init__(
        self,
        folder: Path,
        *,
        apart: bool = False,
        dt: float = 0.02,
        duration: float = 8.0,
        pace: float | str = 1.0,
    ):
        self.folder, self.apart = folder, apart
        self.settings = {"dt": dt, "duration": duration, "pace": pace}
        self._count = 0

    def flooded(
        self, key: str, payload: str, *, rate: int = RATE, seconds: float = SECONDS
    ) -> Told:
        """Run with a flood at a key."""

        def flood(rig: Rig, machine: str, endpoint: str) -> Program:
            return rig.module(
                "tests.reliability.programs.flood",
                *(endpoint, key, "--rate", rate, "--seconds", seconds),
                *("--payload", payload),
                machine=machine,
            )

        said = {text: name for name, text in PAYLOADS.items()}.get(payload, payload)
        return self.run(f"`{key}`: {said}", flood)

    def watched(self, *, frozen: bool) -> Told:
        """Run with a subscriber of everything, that is frozen once it has heard."""

        def watch(rig: Rig, machine: str, endpoint: str) -> Program:
            watcher = rig.module(
                "tests.reliability.programs.watcher", endpoint, machine=machine
            )
            watcher.wait_for("watching")
            if frozen:
                watcher.freeze()
            return watcher

        return self.run(f"a {'frozen' if frozen else 'live'} watcher", watch)

    def run(
        self, what: str, beside: Callable[[Rig, str, str], Program] | None = None
    ) -> Told:
        """Run the lab, with a program beside it from its first ticks on."""
        self._count += 1
        with Rig(self.folder / str(self._count)) as rig:
            hub, lab, desk = (HERE,) * 3
            if self.apart:
                hub, lab, desk = "hub", "lab", "desk"
                rig.connect(hub, lab, desk)
            _, endpoint = rig.router(hub)
            pace = self.settings["pace"]
            pace = f'"{pace}"' if isinstance(pace, str) else pace
            file, out = rig.folder / "lab.toml", rig.folder / "out"
            text = LAB.format(**{**self.settings, "pace": pace}, parts=PARTS)
            file.write_text(text, encoding="utf-8")
            words = "run", file, "--out", out
            run = rig.rems(*words, machine=lab, router=endpoint)
            lateness = out / "lateness.txt"
            self._wait(lambda: lateness.exists() and len(_read(lateness)) > 2, run)
            other = beside(rig, desk, endpoint) if beside else None
            status = run.process.wait(120)
            flood = ""
            if other is not None and other.name == "flood":
                flood = other.wait_for(r"^put .*", 30).group()
            return self._told(what, out, flood, status)

    @staticmethod
    def _wait(condition: Callable[[], bool], run: Program) -> None:
        deadline = time.monotonic() + 40
        while not condition():
            if run.ended is not None or time.monotonic() > deadline:
                raise RuntimeError(f"the run did not begin:\n{run.text()}")
            time.sleep(0.02)

    def _told(self, what: str, out: Path, flood: str, status: int) -> Told:
        times = _read(out / "lateness.txt")
        (out / "lateness.txt").unlink()  # wall time: not of what was computed
        for path in out.glob("*.pid"):
            path.unlink()
        pace, dt = self.settings["pace"], float(self.settings["dt"])
        period = 0.0 if isinstance(pace, str) else dt / pace
        ahead = [at - i * period for i, at in enumerate(times)]
        late = [1000 * (at - min(ahead)) for at in ahead]
        return Told(
            what,
            digest(out),
            len(times),
            max(late) if period else 0.0,
            statistics.median(late) if period else 0.0,
            times[-1] - times[0],
            flood,
            status,
        )


def _read(path: Path) -> list[float]:
    """When each tick came."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    return [float(line.split()[1]) for line in lines if line.endswith("\n")]


HEAD = ["beside it", "same bytes", "ticks", "latest [ms]", "more than quiet [ms]"]
HEAD += ["median late [ms]", "took [s]", "what it said"]
TEXT = f"""A run in real time, 50 ticks a second, with a router in a process of its
own. A plain Zenoh program on another machine puts {RATE:,} messages a second for
{SECONDS:g} s at one key, or a subscriber of everything is frozen. Are the recordings
the same bytes as those of a quiet run, and how much later is the latest tick? The
goal is less than {LIMIT:g} ms. A fast run has no deadlines: the table has the time
that it took."""


def section(*groups: Sequence[Told]) -> Section:
    """Return the section of the page; each group begins with a quiet run.

    Of the floods it has the worst one.
    """
    rows = []
    for quiet, *beside in groups:
        rows.append(quiet.cells(quiet))
        if floods := [one for one in beside if one.flood]:
            worst = max(
                floods, key=lambda one: (one.recordings != quiet.recordings, one.late)
            )
            what = f"a flood at one of {len(floods)} keys; the worst is {worst.what}"
            rows.append([what, *worst.cells(quiet)[1:]])
        rows += [one.cells(quiet) for one in beside if not one.flood]
    return Section("floods", "Floods and frozen watchers", TEXT, table(HEAD, rows))

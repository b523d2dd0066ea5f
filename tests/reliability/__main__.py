"""`python -m tests.reliability`: measure, and write docs/measured/reliability.md."""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tests.reliability import (
    attacks,
    crossings,
    faults,
    firmware,
    floods,
    hands,
    network,
    one_machine,
    page,
    rows,
    standstill,
    stop,
)
from tests.reliability.rig.rig import missing
from tests.reliability.robots import ROBOTS
from tests.reliability.scene import PLACES

DEVICES = [name for name, robot in ROBOTS.items() if robot.emulated]
PAGE = Path(__file__).parents[2] / "docs" / "measured" / "reliability.md"
ALL = (
    *("rig", "standstill", "devices", "stop", "floods", "faults", "attacks", "hands"),
    "crossings",
)
#: tables whose rows can be measured one by one
MENDED = ("standstill", "devices", "faults", "attacks", "hands", "crossings")
#: tables of robots at several places; of devices only the drivers differ
PLACED = ("standstill", "devices")
#: tables that need no machines of their own
HERE = (*PLACED, "attacks", "hands", "crossings")
EXAMPLES = """examples:
  python -m tests.reliability                           all of it, hours; root
  python -m tests.reliability standstill --trials 1     one trial of each row
  python -m tests.reliability standstill --places same alone    needs no root
  python -m tests.reliability standstill --rows router clock     only these rows
  python -m tests.reliability devices --trials 5 --robots create2    needs no root
  python -m tests.reliability stop floods rig
  python -m tests.reliability attacks                   minutes; no root
  python -m tests.reliability hands --trials 3          needs Chromium, no root
  python -m tests.reliability faults --trials 2 --rows router clock
  python -m tests.reliability crossings --rows cable holder    no root
"""


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.reliability",
        description="Measure what faults do, and write docs/measured/reliability.md.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("which", nargs="*", help=f"some of: {', '.join(ALL)}")
    parser.add_argument(
        "--trials",
        type=int,
        help="of each row (20; of STOP 200; of hands 100; of faults 5)",
    )
    parser.add_argument("--places", nargs="+", choices=PLACES, default=PLACES)
    parser.add_argument("--jobs", type=int, default=1, help="rows at a time")
    parser.add_argument(
        "--rows", nargs="+", default=[], metavar="WORD", help="rows with such a word"
    )
    parser.add_argument(
        "--robots", nargs="+", choices=DEVICES, default=DEVICES, help="of `devices`"
    )
    parser.add_argument("--keys", nargs="+", default=floods.KEYS, help="to flood")
    parser.add_argument(
        "--payloads",
        nargs="+",
        choices=list(floods.PAYLOADS),
        default=["no msgpack"],
        help="what to flood with",
    )
    parser.add_argument("--dry", action="store_true", help="write no page")
    parser.add_argument("--page", type=Path, default=PAGE, help="which page to write")
    return parser


class Suite:
    """What was asked for, one measurement after the other."""

    def __init__(self, given: argparse.Namespace, folder: Path):
        self.given, self.folder = given, folder
        self.begun = time.monotonic()

    def say(self, line: str) -> None:
        print(f"{time.monotonic() - self.begun:6.0f} s  {line}", file=sys.stderr)

    def rig(self) -> page.Section:
        return network.section(network.measure(1000, self.folder, tell=self.say))

    def standstill(self) -> page.Section:
        words, places = self.given.rows, self.given.places
        each = [r for r in rows.ROWS if _wanted(r.title, words)]
        trials = self.given.trials or 20
        found = standstill.measure(
            each, places, trials, self.folder, self.say, self.given.jobs
        )
        return standstill.section(found)

    def devices(self) -> page.Section:
        given, found = self.given, []
        for robot in given.robots:
            each = [r for r in rows.ROWS if _wanted(r.title, given.rows)]
            routed = [r for r in each if "alone" not in r.places]
            if robot == standstill.FIRMWARE:
                each, routed = [], [r for r in each if firmware.has(r)]
            for place, some in (("alone", each), ("same", routed)):
                found += standstill.measure(
                    some,
                    [place] if place in given.places else [],
                    given.trials or 20,
                    self.folder,
                    self.say,
                    given.jobs,
                    robot,
                )
        return standstill.devices(found)

    def faults(self) -> page.Section:
        words = self.given.rows
        each = [r for r in faults.ROWS if _wanted(r.title, words)]
        trials = self.given.trials or 5
        found = faults.measure(each, trials, self.folder, self.say)
        if _wanted("rems router serve killed", words):
            found.append(faults.served_again(self.folder / "open", trials))
        found += one_machine.measure(words, self.folder, self.say)
        return faults.section(found)

    def attacks(self) -> page.Section:
        return attacks.section(attacks.measure(self.given.rows, self.folder, self.say))

    def hands(self) -> page.Section:
        some = [way for way in hands.WAYS if _wanted(way.title, self.given.rows)]
        trials = self.given.trials or 100
        return hands.section(hands.measure(some, trials, self.folder, self.say))

    def crossings(self) -> page.Section:
        some = [name for name in crossings.SILENT if _wanted(name, self.given.rows)]
        robots = crossings.ROBOTS
        trials = self.given.trials or 5
        found = crossings.measure(some, robots, trials, self.folder, self.say)
        return crossings.section(found)

    def stop(self) -> page.Section:
        found = []
        for wifi in (False, True):
            folder = self.folder / ("wifi" if wifi else "wire")
            trials = self.given.trials or 200
            found.append(stop.measure(trials, folder, wifi=wifi, tell=self.say))
        return stop.section(found)

    def floods(self) -> page.Section:
        lab = floods.Lab(self.folder, apart=True)
        fast = floods.Lab(self.folder / "fast", apart=True, pace="fast", duration=200.0)
        # Of some, the quietest: a busy machine makes ticks late by itself.
        quiet = min((lab.run("nothing") for _ in range(3)), key=lambda told: told.late)
        found = [quiet]
        for key in self.given.keys:
            for name in self.given.payloads:
                found.append(lab.flooded(key, floods.PAYLOADS[name]))
                self.say(" | ".join(found[-1].cells(quiet)))
        found += [lab.watched(frozen=False), lab.watched(frozen=True)]
        still = fast.run("nothing; fast")
        beside = [still, fast.watched(frozen=False), fast.watched(frozen=True)]
        for one in beside:
            self.say(" | ".join(one.cells(still)))
        return floods.section(found, beside)


def _wanted(title: str, words: Sequence[str]) -> bool:
    return not words or any(word in title for word in words)


def main(argv: Sequence[str] | None = None) -> int:
    parser = arguments()
    given = parser.parse_args(argv)
    names = given.which or ALL
    if unknown := [n for n in names if n not in ALL]:
        parser.error(f"there is no {unknown[0]!r}; there is {', '.join(ALL)}")
    if given.trials is not None and given.trials < 1:
        parser.error(f"--trials is {given.trials}; expected at least 1")
    far = "standstill" in names and "apart" in given.places
    apart = far or not set(names) <= {*HERE}
    if apart and (why := missing()):
        parser.error(f"{why}. Without: standstill --places alone same")
    for name in names:
        with tempfile.TemporaryDirectory(prefix="rems-") as scratch:
            section = getattr(Suite(given, Path(scratch)), name)()
        print(section.show())
        if not given.dry and name != "rig":  # of no use to readers of the page
            all_places = given.places == PLACES and given.robots == DEVICES
            partly = given.rows or (name in PLACED and not all_places)
            if name in MENDED and partly:
                section = page.mend(given.page, section, placed=name in PLACED)
            page.write(given.page, section)
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""`python -m benchmarks`: measure, and write docs/measured/performance.md."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

from benchmarks import (
    dashboard,
    driven,
    footprint,
    gym,
    hand,
    latency,
    learning,
    load,
    lockstep,
    numerics,
    realtime,
    recording,
    report,
    size,
    start,
    swarm,
    sweeps,
    worlds,
)
from benchmarks.contest import Tell

DOCS = Path(__file__).parent.parent / "docs" / "measured"
EXAMPLES = """examples:
  python -m benchmarks                       all of it, about half an hour
  python -m benchmarks lockstep swarm        these two; the page keeps the others
  python -m benchmarks lockstep --repeats 9  more runs
  python -m benchmarks --quick               does it run? tiny, writes nothing
"""
ALL = {
    "lockstep": lockstep.measure,
    "swarm": swarm.measure,
    "recording": recording.measure,
    "worlds": worlds.measure,
    "gym": gym.measure,
    "sweeps": sweeps.measure,
    "latency": latency.measure,
    "realtime": realtime.measure,
    "driven": driven.measure,
    "load": load.measure,
    "start": start.measure,
    "footprint": footprint.measure,
    "dashboard": dashboard.measure,
    "hand": hand.measure,
    "size": size.measure,
    "numerics": numerics.measure,
    "learning": learning.measure,
}


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description="Measure rems_net against floors and peers.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "which", nargs="*", metavar="benchmark", help=f"some of: {', '.join(ALL)}"
    )
    parser.add_argument("--repeats", type=int, default=5, help="runs of each (5)")
    parser.add_argument("--quick", action="store_true", help="one tiny run of each")
    parser.add_argument(
        "--docs", type=Path, default=DOCS, help="the folder for performance.md"
    )
    return parser


def main(argv: list[str] | None = None) -> int:
    parser = arguments()
    given = parser.parse_args(argv)
    names = given.which or list(ALL)
    if unknown := [n for n in names if n not in ALL]:
        parser.error(f"there is no benchmark {unknown[0]!r}; there is {', '.join(ALL)}")
    if given.repeats < 1:
        parser.error(f"--repeats is {given.repeats}; expected at least 1")
    begun = time.monotonic()

    def say(name: str, line: str) -> None:
        print(f"{time.monotonic() - begun:6.0f} s  {name}: {line}", file=sys.stderr)

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) if given.quick else given.docs
        repeats = 1 if given.quick else given.repeats
        for name in names:
            tell: Tell = partial(say, name)
            if name == "size":
                section = size.measure(repeats, given.quick, tell, folder)
            else:
                section = ALL[name](repeats, given.quick, tell)  # type: ignore[operator]
            print(section.show())
            if not given.quick:
                report.write(folder / "performance.md", {name: section}, list(ALL))
    return 0


if __name__ == "__main__":
    sys.exit(main())

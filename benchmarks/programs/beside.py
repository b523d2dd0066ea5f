"""Ticks of a run as fast as possible, beside those who look at all its states.

python -m benchmarks.programs.beside ROBOTS SECONDS BROWSERS

BROWSERS: how many look at the page; 0 for one `rems watch` in place of the page. Prints
the ticks per second.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

from benchmarks.programs.shown import NAME, began, started
from rems_net.client import Fabric

ROOT = Path(__file__).parents[2]
#: s. Those who look have done so for this long before it is measured.
BEFORE = 4.0


def tick(fabric: Fabric) -> tuple[int, float]:
    """Return the number of the newest tick, and when it was read [s]."""
    session = fabric.session
    mails = session.ask(session.key("clock/tick?format=json"), timeout=20, first=True)
    return int(json.loads(mails[0].payload)["n"]), time.monotonic()


def main() -> None:
    robots, seconds, browsers = int(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])
    with ExitStack() as stack:
        fabric, folder = began(stack, robots, "fast")
        rems = (sys.executable, "-m", "rems_net")
        at = ("--fabric", NAME)
        if browsers:
            page = started(stack, folder, *rems[1:], "dashboard", "--no-qr", *at)
            assert page.stdout is not None
            line = next(one for one in page.stdout if "http://" in one)
            link, _, token = line.strip().removeprefix("http://").partition("/#")
            words = ["-m", "benchmarks.programs.page", "look", link, token]
            words += [str(browsers), str(seconds + BEFORE)]
            look = started(stack, ROOT, *words)
            assert look.stdout is not None
            look.stdout.readline()
        else:
            watch = subprocess.Popen(
                [*rems, "watch", f"{NAME}/robot/*/state", *at],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            stack.callback(watch.wait)
            stack.callback(watch.terminate)
            time.sleep(BEFORE)
        first, since = tick(fabric)
        time.sleep(seconds)
        last, until = tick(fabric)
    print(json.dumps({"rate": (last - first) / (until - since)}))


if __name__ == "__main__":
    main()

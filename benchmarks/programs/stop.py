"""STOP of the page: from the click to `stop` on the fabric, while browsers look.

python -m benchmarks.programs.stop ROBOTS BROWSERS STOPS

The page's server and its browsers are each in a process of their own. One browser more
sends what a click sends; another session on the fabric notes when STOP comes, in ms.
"""

from __future__ import annotations

import json
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from statistics import median, quantiles
from threading import Event
from typing import Any

from websockets.sync.client import connect

from benchmarks.programs.shown import NAME, began, started
from rems_net.router.mail import Mail

ROOT = Path(__file__).parents[2]
#: s. Longest time for one STOP.
STOP_TIMEOUT = 10.0


def main() -> None:
    robots, browsers, count = map(int, sys.argv[1:4])
    with ExitStack() as stack:
        fabric, folder = began(stack, robots)
        words = ("-m", "rems_net", "dashboard", "--no-qr", "--fabric", NAME)
        page = started(stack, folder, *words)
        assert page.stdout is not None
        line = next(one for one in page.stdout if "http://" in one)
        link, _, token = line.strip().removeprefix("http://").partition("/#")
        look = ("-m", "benchmarks.programs.page", "look", link, token)
        looking = started(stack, ROOT, *look, str(browsers), "3600")
        assert looking.stdout is not None
        looking.stdout.readline()
        came, at = Event(), 0.0

        def hear(mail: Mail) -> None:
            nonlocal at
            at = time.perf_counter()
            came.set()

        fabric.session.watch_at_once(fabric.session.key("stop"), hear)
        origin: Any = f"http://{link}"
        socket = stack.enter_context(
            connect(f"ws://{link}/", origin=origin, compression=None, max_size=None)
        )
        socket.send(json.dumps({"hello": token, "version": 1}))
        times = []
        for number in range(count):
            came.clear()
            begun = time.perf_counter()
            socket.send(json.dumps({"do": "stop", "id": number}))
            if not came.wait(STOP_TIMEOUT):
                raise SystemExit(f"STOP did not come in {STOP_TIMEOUT:g} s")
            times.append(1000 * (at - begun))
            while True:  # until the robots have answered
                text = socket.recv(20)
                if isinstance(text, str) and "answer" in json.loads(text):
                    break
        fabric.release()
    p99 = quantiles(times, n=100)[98]
    print(json.dumps({"stop": median(times), "stop p99": p99, "most": max(times)}))


if __name__ == "__main__":
    main()

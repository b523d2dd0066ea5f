"""Keys in a browser: from the event of a key to the command on the fabric.

`hand PRESSES` starts a run of one kinematic Woodbot at 50 Hz of real time, the server
of its page and a headless Chromium, each in a process of its own. DevTools press and
release a key; the times are those at which DevTools get the order, at which the command
comes, and at which the robot publishes that it obeys, in ms. `viewer ROBOTS SECONDS`
measures what the server spends for one viewer that looks at all robots: CPU in percent
of a core, and values a second. `seen ROBOTS SECONDS` shows a run in the browser: the
time from its start to a page with all robots [s], the pictures it draws a second where
60 come, and the time of one [ms].
"""

from __future__ import annotations

import json
import os
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from statistics import median, quantiles
from threading import Event
from typing import Any

from websockets.sync.client import connect
from websockets.typing import Subprotocol

from benchmarks.programs.shown import NAME, began, started
from rems_net.dashboard.viewers.wire import SUBPROTOCOLS
from rems_net.router.mail import Mail
from tests.dashboard.browser import browser

#: pictures a second that the server sends to `seen`
RATE = 60
KEY = {"code": "ArrowUp", "key": "ArrowUp", "windowsVirtualKeyCode": 38}


def links(stack: ExitStack, folder: Path, *more: str) -> tuple[str, str, int]:
    """Start the page; return its link, the address of viewers, and its process."""
    words = ("-m", "rems_net", "dashboard", "--no-qr", "--viewers", *more)
    page = started(stack, folder, *words, "--fabric", NAME)
    found = []
    assert page.stdout is not None
    for line in page.stdout:
        found += [word for word in line.split() if "://" in word]
        if found and found[-1].startswith("ws:"):
            break
    return found[0], found[-1], page.pid


def presses(count: int) -> dict[str, Any]:
    """Press a key so often; return the latencies [ms]."""
    times: dict[str, list[float]] = {"put": [], "obeyed": []}
    with ExitStack() as stack:
        fabric, folder = began(stack, 1)
        tab = stack.enter_context(browser(folder))
        link, _, _ = links(stack, folder)
        tab.size(1280, 800)
        tab.go(link)
        tab.until("[...rems.drive.choice.options].some(o => o.value === 'robot/r0')")
        tab.run("rems.drive.choice.value = 'robot/r0'")
        tab.click("rems.drive.button")
        tab.until("rems.drive.beat > 0 && rems.drive.driving['robot/r0']?.drives")
        schema = fabric.schemas("robot/r0")["command"]
        driver = 0
        came: dict[str, float] = {}
        both = Event()

        def hear(mail: Mail) -> None:
            nonlocal driver
            now = time.perf_counter()
            if not schema.decode(mail.payload)["wheel/left"]:
                return
            # The first who puts a command is the hand; then the robot obeys it.
            if "put" not in came:
                came["put"], driver = now, mail.stamp().badge
            elif mail.stamp().badge != driver:
                came["obeyed"] = now
                both.set()

        key = fabric.session.key("robot", "r0", "command")
        fabric.session.watch_at_once(key, hear)
        for _ in range(count):
            both.clear()
            came.clear()
            begun = time.perf_counter()
            tab.send("Input.dispatchKeyEvent", type="keyDown", **KEY)
            both.wait(2.0)
            tab.send("Input.dispatchKeyEvent", type="keyUp", **KEY)
            for name, at in came.items():
                times[name].append(1000 * (at - begun))
            time.sleep(0.15)
    result: dict[str, Any] = {"count": len(times["obeyed"])}
    for name, found in times.items():
        result[name] = median(found)
        result[f"{name} p99"] = quantiles(found, n=100)[98]
    return result


def seen(robots: int, seconds: float) -> dict[str, Any]:
    """Look at all robots in a browser that has never seen the page."""
    with ExitStack() as stack:
        _, folder = began(stack, robots)
        link, _, _ = links(stack, folder, "--rate", str(RATE))
        begun = time.monotonic()
        tab = stack.enter_context(browser(folder))
        tab.size(1280, 800)
        tab.go(link)
        tab.until(f"rems.arena.robots().length === {robots}")
        ready = time.monotonic() - begun
        tab.until(f"rems.cost.frames > {RATE}")  # drawn often, so all is compiled
        cost = "[rems.cost.frames, rems.cost.ms, performance.now()]"
        before = tab.run(cost)
        time.sleep(seconds)
        frames, ms, took = (b - a for a, b in zip(before, tab.run(cost), strict=True))
        return {"ready": ready, "drawn": 1000 * frames / took, "ms": ms / frames}


def cpu(pid: int) -> float:
    """Return the processor time of a process [s]."""
    words = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2]
    ticks = sum(int(word) for word in words.split()[11:13])
    return ticks / os.sysconf("SC_CLK_TCK")


def viewer(robots: int, seconds: float) -> dict[str, Any]:
    """Look at all robots as one viewer."""
    with ExitStack() as stack:
        _, folder = began(stack, robots)
        _, address, pid = links(stack, folder)
        protocol = [Subprotocol(SUBPROTOCOLS[0])]
        link = stack.enter_context(
            connect(address, subprotocols=protocol, compression=None, max_size=None)
        )
        values, looks, begun, used = 0, 0, 0.0, 0.0
        while looks < robots or time.monotonic() < begun + seconds:
            message = link.recv(20)
            if isinstance(message, bytes):
                values += message[0] == 1
                continue
            words = json.loads(message)
            rows = [
                {"id": one["id"], "channelId": one["id"]}
                for one in words.get("channels", [])
                if one["topic"].endswith("/state")
            ]
            if rows:
                looks += len(rows)
                link.send(json.dumps({"op": "subscribe", "subscriptions": rows}))
                begun, used, values = time.monotonic(), cpu(pid), 0
        took = time.monotonic() - begun
        return {"cpu": 100 * (cpu(pid) - used) / took, "values": values / took}


if __name__ == "__main__":
    what, *numbers = sys.argv[1:]
    if what in ("viewer", "seen"):
        look = viewer if what == "viewer" else seen
        print(json.dumps(look(int(numbers[0]), float(numbers[1]))))
    else:
        print(json.dumps(presses(int(what))))

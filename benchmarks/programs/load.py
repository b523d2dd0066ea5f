"""A class at one router: robots in many processes, and many who watch everything.

python -m benchmarks.programs.load HZ SECONDS SESSIONS ROBOTS WATCHERS

Each robot has gone a step further at every tick. A ledger, a member of the run in a
process of its own, reads every state in lock-step and compares it with the tick: what
it misses is lost on a reliable port. The watchers subscribe to `rems/robot/**` with
plain zenoh-python, a session each, five to a process: a run waits for nobody
who only looks.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import zenoh

from benchmarks.parts import Count, Dot
from benchmarks.programs import raw_zenoh
from benchmarks.programs.footprint import resident
from benchmarks.programs.watching import Watcher, go
from rems_net import Experiment, In, Output, Tick
from rems_net.agents.clock.clock import Clock
from rems_net.agents.clock.pacing import LATE

TICKS = "clock/tick"
#: watching sessions in a process
EACH = 5
#: what is put of each robot at every tick
PORTS = 2
#: where the ledger puts what it has found
LEDGER = "LOAD_LEDGER"


class Ledger(Output):
    """Counts the states that are of this tick."""

    robots = In(source="robot/*/state")

    def open(self) -> None:
        self.right = 0

    def write(self, tick: Tick) -> None:
        for state in self.robots.values():
            self.right += round(state["x"] / tick.dt) == tick.n

    def close(self) -> None:
        found = {"right": self.right}
        Path(os.environ[LEDGER]).write_text(json.dumps(found), encoding="utf-8")


class Crowd(Watcher):
    """Starts who watches before anything ticks, and counts what they have heard."""

    def __init__(self, watchers: int):
        super().__init__(TICKS)
        self.sizes = [min(EACH, watchers - i) for i in range(0, watchers, EACH)]
        self.heard: list[int] = []

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        command = [sys.executable, "-m", "benchmarks.programs.load", "watch", endpoint]
        self.processes = [
            subprocess.Popen(
                [*command, str(size)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            for size in self.sizes
        ]
        for process in self.processes:
            assert process.stdout is not None
            process.stdout.readline()
        super().begin(clock, ticks, endpoint)
        self.cpu, self.begun = time.process_time(), time.monotonic()

    def end(self) -> None:
        seconds = time.monotonic() - self.begun
        self.cpu = (time.process_time() - self.cpu) / seconds
        self.memory = resident(os.getpid())
        for process in self.processes:
            said, _ = process.communicate("")
            self.heard += json.loads(said)


def watch(endpoint: str, sessions: int) -> None:
    """Count what comes to each session, until the standard input ends."""
    counts = [0] * sessions
    kept: list[object] = []
    for i in range(sessions):

        def count(_: object, i: int = i) -> None:
            counts[i] += 1

        session = raw_zenoh.open_session(serve=False, endpoint=endpoint)
        handler = zenoh.handlers.Callback(count, indirect=False)
        kept.append(session.declare_subscriber("rems/robot/**", handler))
        kept.append(session)
    print("ready", flush=True)
    sys.stdin.read()
    seen = -1
    while sum(counts) > seen:  # it may be some ticks behind: all of it counts
        seen = sum(counts)
        time.sleep(0.2)
    print(json.dumps(counts), flush=True)
    os._exit(0)


def late(times: list[float], dt: float) -> list[float]:
    """Seconds by which each tick was late, where what was given up is forgotten."""
    found, due = [], times[0]
    for now in times:
        found.append(now - due)
        if now - due > max(2 * dt, LATE):  # real time was begun anew
            due = now
        due += dt
    earliest = min(found)
    return [one - earliest for one in found]


def main() -> None:
    if sys.argv[1] == "watch":
        watch(sys.argv[2], int(sys.argv[3]))
        return
    hz, seconds, *crowd = (int(word) for word in sys.argv[1:])
    sessions, robots, watchers = crowd
    ticks = hz * seconds
    lab = Experiment("load", dt=1 / hz, duration=ticks / hz, record=False)
    for i in range(robots):
        lab.robot(f"r{i}", Dot, Count, host=f"h{i % sessions}")
    lab.output("ledger", Ledger)
    ledger = Path(os.environ.setdefault(LEDGER, f"{os.getpid()}.ledger.json"))
    watcher = Crowd(watchers)
    try:
        go(lab, watcher, pace=1)
        found = json.loads(ledger.read_text(encoding="utf-8"))
    finally:
        ledger.unlink(missing_ok=True)
    times = watcher.tallies[TICKS].times
    lateness = sorted(late(times, 1 / hz))
    expected = ticks * robots * PORTS * watchers
    result = {
        "rate": (len(times) - 1) / (times[-1] - times[0]),
        "p99": 1e3 * lateness[int(0.99 * len(lateness))],
        "lost": ticks * robots - found["right"],
        "heard": sum(watcher.heard) / expected,
        "cpu": watcher.cpu,
        "memory": watcher.memory,
    }
    print(json.dumps(result))


if __name__ == "__main__":
    main()

"""A clock at 1 kHz in real time: how late its ticks are, against a bare loop of sleeps.

python -m benchmarks.programs.paced rems|bare|waiting TICKS

In both, one agent in a process of its own answers every tick, and a subscriber in the
ticking process notes when each tick is put. `waiting` is `bare`, but waits for the
answer to a tick before the next, as lock-step must. Lateness counts from the schedule
through the earliest tick, so what all always lose before the note drops out.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from queue import SimpleQueue
from statistics import median, quantiles

import msgpack

from benchmarks.parts import Count, Dot
from benchmarks.programs import raw_zenoh
from benchmarks.programs.watching import Tally, Watcher, go
from rems_net import Experiment

DT = 0.001
TICKS, STATES = "clock/tick", "robot/*/state"


def rems(ticks: int) -> tuple[list[float], int]:
    """When each tick was put, and how many states came back."""
    lab = Experiment("paced", dt=DT, duration=ticks * DT, record=False)
    lab.robot("r", Dot, Count)
    watcher = Watcher(TICKS, STATES)
    go(lab, watcher, pace=1)
    return watcher.tallies[TICKS].times, len(watcher.tallies[STATES].times)


def bare(ticks: int, wait: bool) -> tuple[list[float], int]:
    """The same by a loop that sleeps until start + n dt, and raw zenoh."""
    put, heard = Tally(), Tally()
    answered: SimpleQueue[object] = SimpleQueue()
    with raw_zenoh.open_session(serve=True) as session:
        direct = raw_zenoh.direct
        hear = [
            session.declare_subscriber(raw_zenoh.TICK, direct(put)),
            session.declare_subscriber("bench/robot/*/state", direct(heard)),
            session.declare_subscriber("bench/robot/*/state", direct(answered)),
        ]
        publisher = session.declare_publisher(raw_zenoh.TICK, **raw_zenoh.LAWS)
        module = "benchmarks.programs.raw_zenoh"
        child = subprocess.Popen([sys.executable, "-m", module, "agent", "r", "1", ""])
        while not list(session.liveliness().get(raw_zenoh.ALIVE)):
            time.sleep(0.05)
        time.sleep(0.3)
        start = time.monotonic()
        for n in range(1, ticks + 1):
            while (left := start + n * DT - time.monotonic()) > 0:
                time.sleep(left)
            publisher.put(msgpack.packb({"n": n}))
            if wait:
                answered.get()
        time.sleep(0.2)
        times, answers = list(put.times), len(heard.times)
        publisher.put(msgpack.packb({"n": 0}))
        child.wait()
        del hear
    return times, answers


def main() -> None:
    ticks = int(sys.argv[2])
    what = sys.argv[1]
    times, answers = rems(ticks) if what == "rems" else bare(ticks, what == "waiting")
    late = [1e6 * (t - n * DT) for n, t in enumerate(times)]
    earliest = min(late)
    late = [x - earliest for x in late]
    second = min(1000, ticks // 3)
    result = {
        "p50": median(late),
        "p99": quantiles(late, n=100)[98],
        "lost": 2 * ticks - len(times) - answers,
        "drift": median(late[-second:]) - median(late[:second]),
    }
    print(json.dumps(result))


if __name__ == "__main__":
    main()

"""What agents cost by being there: start, memory, idle CPU. Reads /proc: Linux.

python -m benchmarks.programs.footprint AGENTS shared|own SECONDS

shared: all in one host; own: a process each. At 10 ticks per second of real time, the
default, nobody tells the robots anything and nobody watches them.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from pathlib import Path

from benchmarks.programs.watching import Watcher, go
from rems_net import Experiment
from rems_net.agents.clock.clock import Clock

TICKS = "clock/tick"


class Usage(Watcher):
    """Looks at the hosts' memory and CPU time while they idle."""

    def __init__(self, seconds: float):
        super().__init__(TICKS)
        self.seconds = seconds
        self.cpu = self.memory = 0.0
        self._thread = threading.Thread(target=self._look)

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        super().begin(clock, ticks, endpoint)
        self._thread.start()

    def end(self) -> None:
        self._thread.join()

    def _look(self) -> None:
        tally = self.tallies[TICKS]
        while len(tally.times) < 5:
            time.sleep(0.05)
        assert self.clock is not None
        pids = {int(str(m["host"]).split(":")[-1]) for m in self.clock.status()}
        before = sum(cpu_seconds(pid) for pid in pids)
        time.sleep(self.seconds)
        self.cpu = (sum(cpu_seconds(pid) for pid in pids) - before) / self.seconds
        self.memory = sum(resident(pid) for pid in pids)


def cpu_seconds(pid: int) -> float:
    threads = Path(f"/proc/{pid}/task").glob("*/schedstat")
    return sum(int(t.read_text().split()[0]) for t in threads) / 1e9


def resident(pid: int) -> float:
    """Megabytes of memory, shared pages counted in full."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def main() -> None:
    agents, seconds = int(sys.argv[1]), float(sys.argv[3])
    begun = time.perf_counter()
    lab = Experiment("idle", dt=0.1, duration=seconds + 1.5, record=False)
    for i in range(agents):
        host = "all" if sys.argv[2] == "shared" else None
        lab.robot(f"bot{i}", "woodbot", "kinematic", host=host)
    usage = Usage(seconds)
    go(lab, usage, pace=1)
    result = {
        "start": usage.tallies[TICKS].times[0] - begun,
        "cpu": 100 * usage.cpu / agents,
        "memory": usage.memory / agents,
    }
    print(json.dumps(result))


if __name__ == "__main__":
    main()

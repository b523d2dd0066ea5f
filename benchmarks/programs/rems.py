"""rems_net in lock-step: N robots, a process each; every state reaches a subscriber.

python -m benchmarks.programs.rems AGENTS TICKS [barrier]

The subscriber lives in the process that ticks, as it does in the other programs.
barrier: every tick waits for the one before.
"""

from __future__ import annotations

import json
import sys

from benchmarks.parts import Count, Dot
from benchmarks.programs.watching import Watcher, go
from rems_net import Experiment

STATES = "robot/*/state"


def main() -> None:
    agents, ticks = int(sys.argv[1]), int(sys.argv[2])
    end = "drop" if "barrier" in sys.argv else "stop"
    lab = Experiment(
        "lockstep", dt=0.01, duration=ticks * 0.01, on_failure=end, record=False
    )
    for i in range(agents):
        lab.robot(f"r{i}", Dot, Count)
    watcher = Watcher(STATES)
    go(lab, watcher)
    tally = watcher.tallies[STATES]
    lost = ticks * agents - len(tally.times)
    print(json.dumps({"rate": tally.rate(agents), "lost": lost}))


if __name__ == "__main__":
    main()

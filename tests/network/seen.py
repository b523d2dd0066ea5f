"""Writes down when an agent's ticks go on: `python -m tests.network.seen robot/zoe`.

A line `<monotonic s> <tick>` for each new tick that the clock has heard of it; all
machines of a rig share that time. The clock's place is told as to any other program.
"""

import sys
import threading
import time

from rems_net.client import join
from rems_net.errors import FabricError


def main() -> None:
    pause, last = threading.Event(), -1
    with join() as fabric:
        print("ready", flush=True)
        while True:
            try:
                rows = fabric.agents()
            except FabricError:  # no clock for the moment
                rows = []
            for row in rows:
                if row["agent"] == sys.argv[1] and row["tick"] != last:
                    last = row["tick"]
                    print(time.monotonic(), last, flush=True)
            pause.wait(0.03)


if __name__ == "__main__":
    main()

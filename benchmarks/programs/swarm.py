"""rems_net: a swarm of kinematic Woodbots in two hosts, each with keys of its own.

python -m benchmarks.programs.swarm ROBOTS TICKS unwatched|here|apart|crowd [HOSTS]

here: one subscriber hears every state, in the process that ticks; apart: in a process
of its own, a client of the router as any program is; crowd: so, too, and by the key
where each host puts the states of all its robots at once.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import Any

import msgpack

from benchmarks.programs import raw_zenoh
from benchmarks.programs.watching import Tally, Watcher, go
from rems_net import Experiment
from rems_net.agents.clock.clock import Clock

STATES, TICKS = "robot/*/state", "clock/tick"
CROWD = "robot/@crowd/state"


class Apart(Watcher):
    """Starts a process that subscribes, before anything ticks."""

    where = STATES

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        super().begin(clock, ticks, endpoint)
        module = [sys.executable, "-m", "benchmarks.programs.swarm"]
        self.process = subprocess.Popen(
            [*module, "watch", endpoint, self.where],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        self.process.stdout.readline()

    def end(self) -> None:
        said, _ = self.process.communicate("")
        self.tallies[STATES] = tally = Tally()
        tally.times = json.loads(said)


class Together(Apart):
    """Subscribes to what hosts say for all their robots at once."""

    where = CROWD


def watch(endpoint: str, where: str) -> None:
    """Note when each robot's state came, until the standard input and they end."""
    tally = Tally()

    def hear_crowd(sample: Any) -> None:
        for values in msgpack.unpackb(sample.payload.to_bytes()).values():
            tally.put(values)

    with raw_zenoh.open_session(serve=False, endpoint=endpoint) as session:
        put = hear_crowd if where == CROWD else tally.put
        hear = session.declare_subscriber(f"rems/{where}", put)
        print("ready", flush=True)
        sys.stdin.read()
        seen = -1
        while len(tally.times) > seen:  # it may be some ticks behind: all of it counts
            seen = len(tally.times)
            time.sleep(0.2)
        del hear
        print(json.dumps(tally.times))


def main() -> None:
    if sys.argv[1] == "watch":
        watch(*sys.argv[2:])
        return
    robots, ticks, where = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    hosts = int(sys.argv[4]) if len(sys.argv) > 4 else 2
    begun = time.perf_counter()
    lab = Experiment("swarm", dt=0.01, duration=ticks * 0.01, record=False)
    for i in range(robots):
        lab.robot(f"bot{i}", "woodbot", "kinematic", host=f"h{i % hosts}")
    kind = {"apart": Apart, "crowd": Together}.get(where, Watcher)
    watcher = kind(TICKS, STATES) if where == "here" else kind(TICKS)
    go(lab, watcher)
    tick = watcher.tallies[TICKS]
    result = {"rate": tick.rate(), "start": tick.times[0] - begun}
    if STATES in watcher.tallies:
        state = watcher.tallies[STATES]
        result["lost"] = robots * ticks - len(state.times)
        result["rate"] = state.rate(robots)
    print(json.dumps(result))


if __name__ == "__main__":
    main()

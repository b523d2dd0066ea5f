"""A bare Zenoh subscriber: it receives what a swarm publishes, and no more.

python -m benchmarks.programs.receiving ROBOTS TICKS

A process of its own publishes three values of each robot a tick, as long as those of a
kinematic Woodbot, with stamps. Prints the microseconds of a robot and tick, of the
processor, in the thread that takes the samples and reads key, payload and stamp of
each: less is not possible for an output that reads what each robot publishes.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from queue import SimpleQueue
from typing import Any

import zenoh

from benchmarks.programs.raw_zenoh import LAWS, direct, open_session
from rems_net.router.message import pack_stamp

ENDPOINT = "tcp/127.0.0.1:7949"
#: bytes of the values of a Woodbot
VALUES = {"command": 37, "state": 40, "sensors": 86}
NEXT, SWARM = "bench/next", "bench/robot/*/@step/*"


def swarm(robots: int) -> None:
    """Publish all values of a tick whenever asked."""
    asked: SimpleQueue[Any] = SimpleQueue()
    with open_session(serve=False, endpoint=ENDPOINT) as session:
        session.declare_subscriber(NEXT, direct(asked))
        keys = [f"bench/robot/bot{i}/@step/{v}" for i in range(robots) for v in VALUES]
        publishers = [session.declare_publisher(key, **LAWS) for key in keys]
        payloads = [bytes(size) for size in VALUES.values()] * robots
        session.put("bench/ready", b"")
        while (n := int(asked.get().payload.to_bytes())) >= 0:
            stamp = pack_stamp(n, n * 0.01, 1 << 40)
            for publisher, payload in zip(publishers, payloads, strict=True):
                publisher.put(payload, attachment=stamp)


def receive(samples: SimpleQueue[Any], count: int) -> None:
    """Take samples, and read them."""
    for _ in range(count):
        sample = samples.get()
        str(sample.key_expr)
        sample.payload.to_bytes()
        sample.attachment.to_bytes()


def measure(robots: int, ticks: int) -> float:
    """Return the microseconds of a robot and tick."""
    samples: SimpleQueue[Any] = SimpleQueue()
    ready: SimpleQueue[Any] = SimpleQueue()
    with open_session(serve=True, endpoint=ENDPOINT) as session:
        session.declare_subscriber("bench/ready", direct(ready))
        session.declare_subscriber(SWARM, direct(samples))
        words = [sys.executable, "-m", "benchmarks.programs.receiving", str(robots)]
        with subprocess.Popen(words):
            ready.get(timeout=60)
            ask = session.declare_publisher(NEXT, **LAWS)
            took = 0.0
            for n in range(ticks + 1):
                ask.put(str(n).encode())
                begun = time.thread_time()
                receive(samples, len(VALUES) * robots)
                if n:  # in the first tick Zenoh learns the keys
                    took += time.thread_time() - begun
            ask.put(b"-1")
    return 1e6 * took / ticks / robots


def main() -> None:
    if len(sys.argv) == 2:
        swarm(int(sys.argv[1]))
        return
    zenoh.init_log_from_env_or("error")
    print(json.dumps({"floor": measure(int(sys.argv[1]), int(sys.argv[2]))}))


if __name__ == "__main__":
    main()

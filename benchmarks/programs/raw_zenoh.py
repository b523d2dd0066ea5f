"""zenoh-python and msgpack and nothing else, in the topology of rems_net: the floor.

python -m benchmarks.programs.raw_zenoh PROCESSES TICKS [STATES] [unwatched]

The ticking session is itself the router; each process answers a tick with STATES
states, each on a key of its own and heard where the tick was made. `unwatched`: nobody
subscribes to them, so each process puts one `done` besides.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from queue import SimpleQueue
from typing import Any

import msgpack
import zenoh

ENDPOINT = "tcp/127.0.0.1:7947"
LAWS: dict[str, Any] = {
    "congestion_control": zenoh.CongestionControl.BLOCK,
    "priority": zenoh.Priority.INTERACTIVE_HIGH,
}
ALIVE, DONE, TICK = "bench/robot/*/@alive", "bench/done", "bench/tick"


def open_session(serve: bool, endpoint: str = ENDPOINT) -> zenoh.Session:
    config: dict[str, Any] = {
        "mode": "router" if serve else "client",
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {"shared_memory": {"enabled": False}},
        "listen" if serve else "connect": {"endpoints": [endpoint]},
    }
    return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))


def direct(queue: Any) -> Any:
    """File what comes, in Zenoh's own thread: the quickest way to one queue."""
    return zenoh.handlers.Callback(queue.put, indirect=False)


def agent(name: str, states: int, watched: bool) -> None:
    """Answer every tick with states of four numbers."""
    ticks: SimpleQueue[Any] = SimpleQueue()
    with open_session(serve=False) as session:
        keys = [f"bench/robot/{name}-{i}/state" for i in range(states)]
        publishers = [session.declare_publisher(k, **LAWS) for k in keys]
        done = session.declare_publisher(DONE, **LAWS)
        hear = session.declare_subscriber(TICK, direct(ticks))
        token = session.liveliness().declare_token(ALIVE.replace("*", name))
        while n := msgpack.unpackb(ticks.get().payload.to_bytes())["n"]:
            stamp = msgpack.packb((n, n * 0.01))
            for publisher in publishers if watched else ():
                value = {"x": n * 0.01, "y": 0.0, "heading": 0.0, "speed": 0.0}
                publisher.put(msgpack.packb(value), attachment=stamp)
            if not watched:
                done.put(msgpack.packb(n), attachment=stamp)
        del hear, token


def tick(processes: int, ticks: int, states: int, watched: bool) -> float:
    """Tick, wait for all answers, tick again. Returns ticks per second."""
    heard: SimpleQueue[Any] = SimpleQueue()
    # Many small messages: a thread that drains them in batches is cheaper.
    many = zenoh.handlers.Callback(heard.put, indirect=states > 1)
    with open_session(serve=True) as session:
        key = "bench/robot/*/state" if watched else DONE
        hear = session.declare_subscriber(key, many)
        publisher = session.declare_publisher(TICK, **LAWS)
        module = [sys.executable, "-m", "benchmarks.programs.raw_zenoh", "agent"]
        rest = [str(states), "" if watched else "unwatched"]
        children = [
            subprocess.Popen([*module, str(i), *rest]) for i in range(processes)
        ]
        while len(list(session.liveliness().get(ALIVE))) < processes:
            time.sleep(0.05)
        time.sleep(0.3)
        warm = ticks // 5
        for n in range(1, ticks + 1):
            if n == warm + 1:
                begun = time.perf_counter()
            message = {"n": n, "t": n * 0.01, "dt": 0.01, "pace": 0.0, "epoch": 1}
            publisher.put(msgpack.packb(message))
            for _ in range(processes * (states if watched else 1)):
                msgpack.unpackb(heard.get().attachment.to_bytes())
        seconds = time.perf_counter() - begun
        publisher.put(msgpack.packb({"n": 0}))
        for child in children:
            child.wait()
        del hear
    return (ticks - warm) / seconds


def main() -> None:
    given = sys.argv[1:]
    watched = given[-1] != "unwatched"
    if given[0] == "agent":
        agent(given[1], int(given[2]), watched)
        return
    states = int(given[2]) if len(given) > 2 else 1
    print(json.dumps({"rate": tick(int(given[0]), int(given[1]), states, watched)}))


if __name__ == "__main__":
    main()

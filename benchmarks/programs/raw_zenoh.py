"""zenoh-python and msgpack and nothing else, in the topology of rems_net: the floor.

python -m benchmarks.programs.raw_zenoh PROCESSES TICKS [STATES] [WHERE]

The ticking session is itself the router; each process answers a tick with STATES
states, each on a key of its own and heard where the tick was made. WHERE `twice`: a
second subscriber there notes when each came; `unwatched`: nobody subscribes to them, so
each process puts one `done` instead; `apart`: a process of its own, a client of the
router, subscribes to them, and each puts a `done`, too. Of an agent, `acted`: it takes
a command of two numbers before each tick.
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
STATES, COMMAND = "bench/robot/*/state", "bench/robot/0/command"


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
    return direct_call(queue.put)


def direct_call(function: Any) -> Any:
    """Call it in Zenoh's own thread."""
    return zenoh.handlers.Callback(function, indirect=False)


def agent(name: str, states: int, where: str) -> None:
    """Answer every tick with states of four numbers."""
    ticks: SimpleQueue[Any] = SimpleQueue()
    with open_session(serve=False) as session:
        keys = [f"bench/robot/{name}-{i}/state" for i in range(states)]
        publishers = [session.declare_publisher(k, **LAWS) for k in keys]
        done = session.declare_publisher(DONE, **LAWS)
        hear = [session.declare_subscriber(TICK, direct(ticks))]
        if where == "acted":
            hear.append(session.declare_subscriber(COMMAND, direct(ticks)))
        token = session.liveliness().declare_token(ALIVE.replace("*", name))
        while (n := msgpack.unpackb(ticks.get().payload.to_bytes()).get("n")) != 0:
            if n is None:
                continue
            stamp = msgpack.packb((n, n * 0.01))
            for publisher in publishers if where != "unwatched" else ():
                value = {"x": n * 0.01, "y": 0.0, "heading": 0.0, "speed": 0.0}
                publisher.put(msgpack.packb(value), attachment=stamp)
            if where in ("unwatched", "apart"):
                done.put(msgpack.packb(n), attachment=stamp)
        del hear, token


def watch() -> None:
    """Note when each state came, until the standard input ends; print that."""
    times: list[float] = []
    with open_session(serve=False) as session:
        hear = session.declare_subscriber(
            STATES, lambda sample: times.append(time.perf_counter())
        )
        print("ready", flush=True)
        for line in sys.stdin:
            while len(times) < int(line):
                time.sleep(0.05)
            print(json.dumps(times), flush=True)
        del hear


def tick(processes: int, ticks: int, states: int, where: str) -> float:
    """Tick, wait for all answers, tick again. Returns ticks per second."""
    heard: SimpleQueue[Any] = SimpleQueue()
    # Many small messages: a thread that drains them in batches is cheaper.
    many = zenoh.handlers.Callback(heard.put, indirect=states > 1)
    with open_session(serve=True) as session:
        key = STATES if where in ("", "twice") else DONE
        hear = [session.declare_subscriber(key, many)]
        if where == "twice":
            noted: list[float] = []
            note = direct_call(lambda sample: noted.append(time.perf_counter()))
            hear.append(session.declare_subscriber(key, note))
        publisher = session.declare_publisher(TICK, **LAWS)
        module = [sys.executable, "-m", "benchmarks.programs.raw_zenoh", "agent"]
        watcher = start_watcher() if where == "apart" else None
        said_done = where if key == DONE else ""
        children = [
            subprocess.Popen([*module, str(i), str(states), said_done])
            for i in range(processes)
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
            for _ in range(processes * (1 if key == DONE else states)):
                msgpack.unpackb(heard.get().attachment.to_bytes())
        seconds = time.perf_counter() - begun
        publisher.put(msgpack.packb({"n": 0}))
        for child in children:
            child.wait()
        if watcher is not None:
            each = processes * states
            said, _ = watcher.communicate(f"{each * ticks}\n")
            times = json.loads(said)
            seconds = times[-1] - times[each * warm - 1]
        del hear
    return (ticks - warm) / seconds


def start_watcher() -> subprocess.Popen[str]:
    """A process that subscribes; returns when it has."""
    module = [sys.executable, "-m", "benchmarks.programs.raw_zenoh", "watch"]
    pipe = subprocess.PIPE
    watcher = subprocess.Popen(module, stdin=pipe, stdout=pipe, text=True)
    assert watcher.stdout is not None
    watcher.stdout.readline()
    return watcher


def main() -> None:
    given = sys.argv[1:]
    if given[0] == "watch":
        watch()
        return
    where = given.pop() if not given[-1].isdecimal() else ""
    if given[0] == "agent":
        agent(given[1], int(given[2]), where)
        return
    states = int(given[2]) if len(given) > 2 else 1
    print(json.dumps({"rate": tick(int(given[0]), int(given[1]), states, where)}))


if __name__ == "__main__":
    main()

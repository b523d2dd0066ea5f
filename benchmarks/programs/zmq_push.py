"""pyzmq in lock-step: PUB/SUB for the tick, PUSH/PULL for the states."""

from __future__ import annotations

import json
import subprocess
import sys
import time

import msgpack
import zmq  # type: ignore[import-not-found,unused-ignore]

TICK, STATE = "tcp://127.0.0.1:7957", "tcp://127.0.0.1:7958"


def answer(name: str) -> None:
    """One agent: a state of four numbers, under its own key, for every tick."""
    key = f"bench/robot/{name}/state".encode()
    with zmq.Context() as context:
        ticks, states = context.socket(zmq.SUB), context.socket(zmq.PUSH)
        ticks.subscribe(b"")
        ticks.connect(TICK)
        states.connect(STATE)
        states.send(b"here")
        n = -1
        while n != 0:
            n = msgpack.unpackb(ticks.recv())["n"]
            value = {"x": n * 0.1, "y": 0.0, "heading": 0.0, "speed": 0.0}
            states.send_multipart([key, msgpack.packb([n, n * 0.1, value])])
        ticks.close()
        states.close()


def tick(agents: int, ticks: int) -> float:
    """Tick, wait for all states, tick again. Returns ticks per second."""
    with zmq.Context() as context:
        publisher, states = context.socket(zmq.PUB), context.socket(zmq.PULL)
        publisher.bind(TICK)
        states.bind(STATE)
        module = [sys.executable, "-m", "benchmarks.programs.zmq_push"]
        children = [subprocess.Popen([*module, "agent", str(i)]) for i in range(agents)]
        for _ in range(agents):
            states.recv()
        time.sleep(0.3)  # a SUB socket does not say when it is connected
        warm = ticks // 5
        for n in range(1, ticks + 1):
            if n == warm + 1:
                begun = time.perf_counter()
            message = {"n": n, "t": n * 0.01, "dt": 0.01, "pace": 0.0, "epoch": 1}
            publisher.send(msgpack.packb(message))
            for _ in range(agents):
                _key, payload = states.recv_multipart()
                msgpack.unpackb(payload)
        seconds = time.perf_counter() - begun
        publisher.send(msgpack.packb({"n": 0}))
        for child in children:
            child.wait()
        publisher.close()
        states.close()
    return (ticks - warm) / seconds


def main() -> None:
    if sys.argv[1] == "agent":
        answer(sys.argv[2])
    else:
        print(json.dumps({"rate": tick(int(sys.argv[1]), int(sys.argv[2]))}))


if __name__ == "__main__":
    main()

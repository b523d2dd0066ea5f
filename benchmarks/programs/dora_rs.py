"""dora-rs in lock-step: a node that ticks and N nodes that answer, on one daemon."""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import dora  # type: ignore[import-untyped,import-not-found,unused-ignore]
import msgpack


def answer() -> None:
    """One node: a state of four numbers for every tick, until its inputs end."""
    node = dora.Node()
    for event in node:
        if event["type"] == "INPUT":
            n = msgpack.unpackb(event["value"].to_numpy().tobytes())["n"]
            value = {"x": n * 0.1, "y": 0.0, "heading": 0.0, "speed": 0.0}
            node.send_output("state", msgpack.packb([n, n * 0.1, value]))


def tick(agents: int, ticks: int, result: Path) -> None:
    """Tick, wait for all states, tick again. Writes ticks per second to `result`."""
    node = dora.Node()
    time.sleep(0.3)
    warm = ticks // 5
    for n in range(1, ticks + 1):
        if n == warm + 1:
            begun = time.perf_counter()
        message = {"n": n, "t": n * 0.01, "dt": 0.01, "pace": 0.0, "epoch": 1}
        node.send_output("tick", msgpack.packb(message))
        missing = agents
        while missing:
            event = node.next()
            if event["type"] == "INPUT":
                msgpack.unpackb(event["value"].to_numpy().tobytes())
                missing -= 1
    rate = (ticks - warm) / (time.perf_counter() - begun)
    result.write_text(json.dumps({"rate": rate}))


def dataflow(agents: int, ticks: int, result: Path) -> dict[str, Any]:
    """What dora calls a dataflow: who runs what, and who hears whom."""
    module = "-m benchmarks.programs.dora_rs"
    clock = {
        "id": "clock",
        "path": sys.executable,
        "args": f"{module} clock {agents} {ticks} {result}",
        "inputs": {
            f"s{i}": {"source": f"r{i}/state", "queue_size": 10} for i in range(agents)
        },
        "outputs": ["tick"],
    }
    robots = [
        {
            "id": f"r{i}",
            "path": sys.executable,
            "args": f"{module} agent",
            "inputs": {"tick": {"source": "clock/tick", "queue_size": 10}},
            "outputs": ["state"],
        }
        for i in range(agents)
    ]
    return {"nodes": [clock, *robots]}


def run(agents: int, ticks: int) -> str:
    os.environ["PYTHONPATH"] = os.pathsep.join(sys.path)
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "result.json"
        flow = Path(folder) / "dataflow.yml"
        flow.write_text(json.dumps(dataflow(agents, ticks, result)))
        os.chdir(folder)
        dora.run(str(flow))
        os.chdir("/")
        return result.read_text()


def main() -> None:
    if sys.argv[1] == "agent":
        answer()
    elif sys.argv[1] == "clock":
        tick(int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
    else:
        print(run(int(sys.argv[1]), int(sys.argv[2])))


if __name__ == "__main__":
    main()

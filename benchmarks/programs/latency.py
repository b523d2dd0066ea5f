"""How old a value is when another agent sees it: rems_net against raw zenoh.

python -m benchmarks.programs.latency rems|raw TICKS

At every tick of a 200 Hz clock a robot notes the time in its state; an output in
another process reads the state within the same tick, and notes how old it is. Both are
clients of the ticking process, as all agents are. The clocks agree: one machine.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from queue import SimpleQueue
from statistics import median, quantiles
from typing import Any

import msgpack

from benchmarks.parts import COMMAND
from benchmarks.programs import raw_zenoh
from benchmarks.programs.watching import go
from rems_net import Definition, Driver, Experiment, In, Out, Output, Schema, Tick
from rems_net.agents.experiment.show import Show
from rems_net.defdict import DefDict, length, number
from rems_net.events import Event

DT = 0.005
STATE = Schema(
    "bench.sent", {"sent": number(), "x": length(), "y": length(), "z": length()}
)


class Sender(Definition):
    command = In(COMMAND)
    state = Out(STATE)


class Now(Driver):
    """Writes the time into its state."""

    def drive(self, command: DefDict, dt: float) -> None:
        self.state.sent = time.perf_counter()

    def sense(self) -> None:
        pass


class Age(Output):
    """Prints how old [s] the sender's state was at each tick, at the end."""

    state = In(STATE, source="robot/sender/state")

    def open(self) -> None:
        self.ages: list[float] = []

    def write(self, tick: Tick) -> None:
        self.ages.append(time.perf_counter() - self.state.sent)

    def close(self) -> None:
        print(json.dumps(self.ages), flush=True)


class Catch(Show):
    """Keeps what the output printed."""

    ages: list[float]

    def say(self, source: str, event: Event) -> None:
        self.ages = json.loads(event.text)


def rems(ticks: int) -> list[float]:
    lab = Experiment("latency", dt=DT, duration=ticks * DT, record=False)
    lab.robot("sender", Sender, Now)
    lab.output("age", Age)
    catch = Catch()
    go(lab, catch, pace=1)
    return catch.ages


def raw_agent(sends: bool, ticks: int) -> None:
    """The same with zenoh-python: note the time and put, or take and compare."""
    box: SimpleQueue[Any] = SimpleQueue()
    ages = []
    with raw_zenoh.open_session(serve=False) as session:
        state = session.declare_publisher("bench/state", **raw_zenoh.LAWS)
        done = session.declare_publisher(raw_zenoh.DONE, **raw_zenoh.LAWS)
        key = raw_zenoh.TICK if sends else "bench/state"
        hear = session.declare_subscriber(key, raw_zenoh.direct(box))
        done.put(b"")
        for n in range(ticks):
            sample = box.get()
            if sends:
                value = {"sent": time.perf_counter(), "x": 0.0, "y": 0.0, "z": 0.0}
                state.put(msgpack.packb(value), attachment=msgpack.packb((n, n * DT)))
            else:
                value = msgpack.unpackb(sample.payload.to_bytes())
                ages.append(time.perf_counter() - value["sent"])
            done.put(msgpack.packb(n))
        del hear
    print(json.dumps(ages))


def raw(ticks: int) -> list[float]:
    box: SimpleQueue[Any] = SimpleQueue()
    with raw_zenoh.open_session(serve=True) as session:
        hear = session.declare_subscriber(raw_zenoh.DONE, raw_zenoh.direct(box))
        publisher = session.declare_publisher(raw_zenoh.TICK, **raw_zenoh.LAWS)
        module = [sys.executable, "-m", "benchmarks.programs.latency"]
        children = [
            subprocess.Popen([*module, w, str(ticks)], stdout=subprocess.PIPE)
            for w in ("sender", "reader")
        ]
        for _ in children:
            box.get()
        time.sleep(0.3)
        start = time.monotonic()
        for n in range(ticks):
            time.sleep(max(0.0, start + n * DT - time.monotonic()))
            publisher.put(msgpack.packb({"n": n}))
            for _ in children:
                box.get()
        del hear
        said = [child.communicate()[0] for child in children]
    ages: list[float] = json.loads(said[1])
    return ages


def main() -> None:
    what, ticks = sys.argv[1], int(sys.argv[2])
    if what in ("sender", "reader"):
        raw_agent(what == "sender", ticks)
        return
    ages = (rems if what == "rems" else raw)(ticks)[ticks // 5 :]
    micro = [a * 1e6 for a in ages]
    print(json.dumps({"median": median(micro), "p99": quantiles(micro, n=100)[98]}))


if __name__ == "__main__":
    main()

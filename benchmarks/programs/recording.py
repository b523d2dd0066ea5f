"""Processor time of two outputs that record one swarm: in CSV files, and in MCAP.

python -m benchmarks.programs.recording ROBOTS TICKS WAY

here: all in one process, by the engine.  apart: each output in a process of its own,
which receives messages.  shared: the recorder in the process of the CSV output, as in
every run.  each: so, too, and each robot in a process of its own.  alone: one output
after the other, in a process of its own.

Prints the microseconds of a robot and tick: of each output, of an output that only
reads and of a bare Zenoh subscriber (apart), and of the whole tick on the wall (shared,
each, alone).
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from rems_net import Experiment, In, Output
from rems_net.agents.experiment.show import Show
from rems_net.agents.tick import Tick
from rems_net.outputs.csv import CsvOutput
from rems_net.outputs.mcap import McapOutput

#: ticks before the first that counts: files are made in them
BEFORE = 3
#: in what each output leaves what it took
TOOK = "{}.took"


class Timed:
    """Measures its thread: filling the Ins of all outputs in it, and recording."""

    def step(self, tick: Tick) -> None:
        """Do a step, and note the processor time from one to the next."""
        super().step(tick)  # type: ignore[misc]
        now = np.array((time.thread_time(), time.perf_counter()))
        if tick.n <= BEFORE:
            self._begun = now
        else:
            took = (now - self._begun) / (tick.n - BEFORE)
            path: Path = self.out / TOOK.format(self.name)  # type: ignore[attr-defined]
            path.write_text(json.dumps(took.tolist()), encoding="ascii")


class TimedCsv(Timed, CsvOutput):
    """CsvOutput, measured."""


class TimedMcap(Timed, McapOutput):
    """McapOutput, measured."""


class Reading(Timed, Output):
    """An output that only reads."""

    robots = In(source="robot/*/*")

    def write(self, tick: Tick) -> None:
        """Write nothing."""


def swarm(robots: int, ticks: int, *, record: bool = False) -> Experiment:
    """Make the experiment, without outputs. record: whether it has a recorder."""
    lab = Experiment("swarm", dt=0.01, duration=ticks * 0.01, record=record)
    for i in range(robots):
        lab.robot(f"bot{i}", "woodbot", "kinematic", host="swarm")
    return lab


def run(lab: Experiment, out: Path, *names: str) -> list[tuple[float, float]]:
    """Run it. Returns seconds of a tick by output: of the processor, on the wall."""
    lab.run(out, show=Show())
    texts = [(out / TOOK.format(name)).read_text(encoding="ascii") for name in names]
    return [tuple(json.loads(text)) for text in texts]


def apart(lab: Experiment, out: Path) -> dict[str, float]:
    """Run it with a process for each output. Returns seconds of a tick."""
    names = {"csv": TimedCsv, "mcap": TimedMcap, "reading": Reading}
    for name, cls in names.items():
        lab.output(name, cls)
    took = zip(names, run(lab, out, *names), strict=True)
    return {name: seconds for name, (seconds, _) in took} | {"floor": floor(lab)}


def floor(lab: Experiment) -> float:
    """Return the seconds that a bare Zenoh subscriber takes for as many messages."""
    robots = sum(plan.kind == "robot" for plan in lab.plans.values())
    words = [sys.executable, "-m", "benchmarks.programs.receiving", str(robots), "20"]
    done = subprocess.run(words, stdout=subprocess.PIPE, check=True)
    return float(json.loads(done.stdout)["floor"]) * robots / 1e6


def shared(lab: Experiment, out: Path) -> dict[str, float]:
    """Run it with a CSV output, without and with a recorder in its process.

    Twice each; the least counts, since what else a machine does only adds time.
    """
    lab.output("csv", TimedCsv)
    found: dict[bool, list[tuple[float, float]]] = {False: [], True: []}
    for i in range(4):
        lab.record = i % 2 == 1
        found[lab.record] += run(lab, out / str(i), "csv")
    (csv, wall), (both, _) = min(found[False]), min(found[True])
    return {"csv": csv, "mcap": both - csv, "tick": wall}


def alone(lab: Experiment, out: Path) -> dict[str, float]:
    """Run it with one output. Returns seconds of a tick on the wall, by output."""
    took: dict[str, float] = {}
    for name, cls in (("reading", Reading), ("mcap", TimedMcap)):
        lab.output(name, cls)
        ((_, took[name]),) = run(lab, out / name, name)
        del lab.plans[f"output/{name}"]
    return took


def each(lab: Experiment, out: Path) -> dict[str, float]:
    """The same with a process for each robot."""
    for plan in lab.plans.values():
        plan.host = plan.key
    return shared(lab, out)


def here(lab: Experiment, out: Path) -> dict[str, float]:
    """Run it in the engine. Returns seconds of a tick, by output."""
    lab.output("csv", "csv")
    lab.output("mcap", "mcap")
    took = dict.fromkeys(("csv", "mcap"), 0.0)
    with lab.engine(out) as engine:
        engine.step(BEFORE)
        assert engine._engine is not None
        phases = [p for p in engine._engine._phases if p.kind == "output"]
        for n in range(BEFORE + 1, lab.ticks({}) + 1):
            tick = Tick(n, n * lab.dt, lab.dt)
            for other in engine._engine._phases[: -len(phases)]:
                for inlet in other.inlets:
                    inlet.fill(tick)
                for step in other.steps:
                    step(tick)
            for name in took:
                begun = time.thread_time()
                for inlet in (i for p in phases for i in p.inlets):
                    if inlet.agent.name == name:
                        inlet.fill(tick)
                engine[f"output/{name}"].step(tick)
                took[name] += time.thread_time() - begun
    return {name: sum_ / (lab.ticks({}) - BEFORE) for name, sum_ in took.items()}


def main() -> None:
    robots, ticks, where = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    with tempfile.TemporaryDirectory() as folder:
        way = {
            "here": here,
            "apart": apart,
            "shared": shared,
            "each": each,
            "alone": alone,
        }[where]
        took = way(swarm(robots, ticks), Path(folder) / "out")
    print(json.dumps({name: 1e6 * took[name] / robots for name in took}))


if __name__ == "__main__":
    main()

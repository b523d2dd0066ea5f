"""Processor time of two outputs that record one swarm: in CSV files, and in MCAP.

python -m benchmarks.programs.recording ROBOTS TICKS here|apart

here: all in one process, by the engine.  apart: each output in a process of its own,
which receives messages. Prints the microseconds of a robot and tick, of each output.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path

from rems_net import Experiment
from rems_net.agents.experiment.show import Show
from rems_net.agents.tick import Tick
from rems_net.outputs.csv import CsvOutput
from rems_net.outputs.mcap import McapOutput

#: ticks before the first that counts: files are made in them
BEFORE = 3
#: in what each output leaves what it took
TOOK = "{}.took"


class Timed:
    """Measures its thread, which fills the Ins, records, and does nothing else."""

    def step(self, tick: Tick) -> None:
        """Do a step, and note the processor time from one to the next."""
        super().step(tick)  # type: ignore[misc]
        now = time.thread_time()
        if tick.n <= BEFORE:
            self._begun = now
        else:
            took = str((now - self._begun) / (tick.n - BEFORE))
            path: Path = self.out / TOOK.format(self.name)  # type: ignore[attr-defined]
            path.write_text(took, encoding="ascii")


class TimedCsv(Timed, CsvOutput):
    """CsvOutput, measured."""


class TimedMcap(Timed, McapOutput):
    """McapOutput, measured."""


def swarm(robots: int, ticks: int) -> Experiment:
    """Make the experiment, without outputs."""
    lab = Experiment("swarm", dt=0.01, duration=ticks * 0.01)
    for i in range(robots):
        lab.robot(f"bot{i}", "woodbot", "kinematic", host="swarm")
    return lab


def apart(lab: Experiment, out: Path) -> dict[str, float]:
    """Run it in processes. Returns seconds of a tick, by output."""
    lab.output("csv", TimedCsv)
    lab.output("mcap", TimedMcap)
    lab.run(out, show=Show())
    return {
        name: float((out / TOOK.format(name)).read_text(encoding="ascii"))
        for name in ("csv", "mcap")
    }


def here(lab: Experiment, out: Path) -> dict[str, float]:
    """Run it in the engine. Returns seconds of a tick, by output."""
    lab.output("csv", "csv")
    lab.output("mcap", "mcap")
    took = dict.fromkeys(("csv", "mcap"), 0.0)
    with lab.engine(out) as engine:
        engine.step(BEFORE)
        assert engine._engine is not None
        (phase,) = (p for p in engine._engine._phases if p.kind == "output")
        for n in range(BEFORE + 1, lab.ticks({}) + 1):
            tick = Tick(n, n * lab.dt, lab.dt)
            for other in engine._engine._phases[:-1]:
                for inlet in other.inlets:
                    inlet.fill(tick)
                for step in other.steps:
                    step(tick)
            for name in took:
                begun = time.thread_time()
                for inlet in phase.inlets:
                    if inlet.agent.name == name:
                        inlet.fill(tick)
                engine[f"output/{name}"].step(tick)
                took[name] += time.thread_time() - begun
    return {name: sum_ / (lab.ticks({}) - BEFORE) for name, sum_ in took.items()}


def main() -> None:
    robots, ticks, where = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    with tempfile.TemporaryDirectory() as folder:
        way = {"here": here, "apart": apart}[where]
        took = way(swarm(robots, ticks), Path(folder) / "out")
    print(json.dumps({name: 1e6 * took[name] / robots for name in took}))


if __name__ == "__main__":
    main()

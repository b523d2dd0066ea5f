"""Many runs of one experiment: by one engine after another, or by a sweep.

python -m benchmarks.programs.sweeping engine|sweep RUNS TICKS

Both write the files of each run. A sweep also checks its sources, and writes a table.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.parts import Circling
from rems_net import Experiment, sweep
from rems_net.sweeps.pool import cores

#: s
DT = 0.01


def experiment(ticks: int) -> Experiment:
    """The experiment that both run."""
    lab = Experiment("sweeping", dt=DT, duration=ticks * DT)
    lab.robot("sim", Circling, "kinematic")
    return lab


def engines(runs: int, ticks: int, folder: Path) -> None:
    """Make the runs in this process."""
    for seed in range(runs):
        lab = experiment(ticks)
        lab.seed = seed
        with lab.engine(out=folder / str(seed)) as engine:
            engine.run()


def main() -> None:
    which, runs, ticks = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    with tempfile.TemporaryDirectory() as scratch:
        begun = time.perf_counter()
        if which == "engine":
            engines(runs, ticks, Path(scratch))
        else:
            sweep(experiment(ticks), seeds=runs, out=Path(scratch) / "swept")
        rate = runs / (time.perf_counter() - begun)
    print(json.dumps({"rate": rate, "cores": cores()}))


if __name__ == "__main__":
    main()

"""Many runs of one experiment on all cores, beside one engine."""

from __future__ import annotations

from benchmarks.contest import Contender, Spread, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Many runs"
ENGINE, SWEEP = "one engine after another", "a sweep"
RUNS, TICKS = 480, 1000
TEXT = f"""A kinematic Woodbot drives {TICKS} ticks, {RUNS} times, with a recording of
each run: in one process, and by [a sweep](../sweeps.md) with a process for each core.
The time of a sweep has the start of its processes, its checks and its table in it."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    size = (4, 20) if quick else (RUNS, TICKS)
    names = {ENGINE: "engine", SWEEP: "sweep"}
    contenders = [Contender(n, "sweeping", (w, *size)) for n, w in names.items()]
    found = interleave(contenders, repeats, tell)
    cores = found.spread(SWEEP, "cores").median
    ratio = found.ratio(SWEEP, ENGINE)
    share = Spread(tuple(one / cores for one in ratio.values))
    rows = [[name, found.spread(name).show(".1f")] for name in names]
    text = [
        TEXT,
        table(["", "runs a second"], rows),
        f"On {cores:.0f} cores a sweep made {ratio.show()} times as many.",
    ]
    goal = Target("a sweep over cores times one engine", share, 0.9)
    return Section("sweeps", TITLE, text, [goal])

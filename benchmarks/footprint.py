"""What agents cost by being there: start, memory, idle CPU."""

from __future__ import annotations

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Start, memory and idle CPU"
ONE, SHARED, OWN = "1 agent", "100 agents, one host", "100 agents, a process each"

TEXT = """Kinematic Woodbots at 10 ticks per second of real time, the default, without
commands and watchers. *Start* is from the first line of the script's experiment to the
first tick. Memory is resident memory per agent, with shared pages counted in each."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    agents, seconds = (3, 0.5) if quick else (100, 4)
    contenders = [
        Contender(ONE, "footprint", (1, "own", seconds)),
        Contender(SHARED, "footprint", (agents, "shared", seconds)),
        Contender(OWN, "footprint", (agents, "own", seconds)),
    ]
    found = interleave(contenders, repeats, tell)
    columns = (("start", ".2f"), ("cpu", ".3f"), ("memory", ".2f"))
    rows = [
        [name, *(found.spread(name, what).show(form) for what, form in columns)]
        for name, runs in found.runs.items()
        if runs
    ]
    head = ["", "start [s]", "CPU per agent [% of a core]", "memory per agent [MB]"]
    text = [TEXT, table(head, rows)]
    text += [f"Left out: {reason}" for reason in found.missing.values()]
    aims = [
        ("idle CPU of an agent in a process of its own [%]", ONE, "cpu", 1),
        ("start of 100 agents in one host [s]", SHARED, "start", 10),
        ("start of 100 agents, a process each [s]", OWN, "start", 10),
        ("memory per agent in a shared host [MB]", SHARED, "memory", 12),
    ]
    targets = [
        Target(label, found.spread(name, what), bound, at_least=False)
        for label, name, what, bound in aims
        if found.runs[name]
    ]
    return Section("footprint", TITLE, text, targets)

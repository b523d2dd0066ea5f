"""How long a short run takes: in processes, and in one by the engine."""

from __future__ import annotations

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "A short run, from the command to its end"
PROCESSES, DIRECT, NUMPY = "rems run", "rems run --direct", "python -c 'import numpy'"

TEXT = """`rems run weave.py` with the README's first experiment, {seconds} s of fabric
time as fast as possible. Both columns count from the moment at which the command is
typed. The floor imports numpy and does nothing else."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    seconds = 1 if quick else 10
    ways = {PROCESSES: "processes", DIRECT: "direct", NUMPY: "numpy"}
    contenders = [Contender(n, "start", (way, seconds)) for n, way in ways.items()]
    found = interleave(contenders, repeats, tell)
    rows = []
    for name, runs in found.runs.items():
        if runs:
            first = "" if name == NUMPY else found.spread(name, "first").show()
            rows.append([name, first, found.spread(name, "whole").show()])
    head = ["", "first tick [s]", "whole run [s]"]
    text = [TEXT.format(seconds=seconds), table(head, rows)]
    text += [f"Left out: {reason}" for reason in found.missing.values()]
    targets = []
    for name, most in ((DIRECT, 0.4), (PROCESSES, 1.2)):
        if found.runs[name]:
            whole = found.spread(name, "whole")
            targets.append(Target(f"{name} [s]", whole, most, at_least=False))
    return Section("start", TITLE, text, targets)

"""A class at one router: what thirty laptops' worth of agents and watchers cost."""

from __future__ import annotations

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "A class at one router"
RATES = (20, 30, 50, 100)

TEXT = """Thirty processes with two robots each, in real time, and thirty watchers of
everything, on one machine. *Wrong or lost* counts the errors of a member that reads
every state. *Late* is each tick, from the schedule. A run that is too much for the
machine becomes slower than real time, and reports it. `heard` is the part of all
values that watchers received. The last columns are of the router and the clock, which
are one process."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    size = (2, 4, 2) if quick else (30, 60, 30)
    seconds = 2 if quick else 10
    rates = RATES[:1] if quick else RATES
    found = interleave(
        [Contender(f"{hz} Hz", "load", (hz, seconds, *size)) for hz in rates],
        min(repeats, 3),
        tell,
    )
    rows = []
    for name, runs in found.runs.items():
        if runs:
            rows.append(
                [
                    name,
                    found.spread(name, "rate").show(".0f"),
                    found.spread(name, "p99").show(".1f"),
                    found.spread(name, "lost").show(".0f"),
                    found.spread(name, "heard").show(".3f"),
                    found.spread(name, "cpu").show(".2f"),
                    found.spread(name, "memory").show(".0f"),
                ]
            )
    head = ["asked", "ticks/s", "p99 late [ms]", "wrong or lost", "heard"]
    section = Section("load", TITLE, [TEXT, table([*head, "cores", "MB"], rows)])
    section.text += [f"Left out: {reason}" for reason in found.missing.values()]
    section.targets = [
        Target(f"{name}, wrong or lost", found.spread(name, "lost"), 0, False, ".0f")
        for name, runs in found.runs.items()
        if runs
    ]
    return section

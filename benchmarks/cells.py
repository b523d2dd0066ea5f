"""What a step of every robot costs, with every driver that can do it here."""

from __future__ import annotations

from benchmarks.contest import Contender, Table, Tell, interleave
from benchmarks.report import Section, table

TITLE = "Every robot, every driver"
CELLS = "cells"

TEXT = """Steps of 0.1 s per second of wall time, in one process, without a fabric:
command, state and all sensors included, by `rems_net.testing.matrix.speed`; the engines
run in steps of 1 ms. `rems check robots` measures the same here and now, and also how
far each is from its own mathematics (`robots_check.md`)."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    args = ("--quick",) if quick else ()
    found = interleave([Contender(CELLS, "cells", args)], repeats, tell)
    text = [TEXT, _table(found)]
    text += [f"Left out: {reason}" for reason in found.missing.values()]
    return Section("cells", TITLE, text)


def _table(found: Table) -> str:
    names = [name.split() for name in next(iter(found.runs[CELLS]), {})]
    columns = list(dict.fromkeys(driver for _, driver in names))
    rows = []
    for robot in dict.fromkeys(robot for robot, _ in names):
        row = [robot]
        for driver in columns:
            known = [robot, driver] in names
            row.append(_speed(found, f"{robot} {driver}") if known else "")
        rows.append(row)
    return table(["steps/s", *columns], rows)


def _speed(found: Table, name: str) -> str:
    steps = 1e6 / found.spread(CELLS, name).median
    return f"{float(f'{steps:.3g}'):g}"

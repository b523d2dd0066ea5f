"""What it costs to record a swarm, in CSV files and in one MCAP file."""

from __future__ import annotations

from benchmarks.contest import Contender, Spread, Table, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Recording a swarm"
HERE, APART = "engine", "processes"

TEXT = """Processor time of two outputs in one run, which record command, state and
sensors of {} kinematic Woodbots: CSV writes a file for each robot, MCAP one for all. In
the engine, that is what an output itself does. In processes it is what its thread does,
most of which is to receive three messages a robot and tick, whatever is recorded."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    robots, ticks = (5, 6) if quick else (1000, 60)
    contenders = [
        Contender(HERE, "recording", (robots, ticks, "here")),
        Contender(APART, "recording", (robots, ticks, "apart")),
    ]
    found = interleave(contenders, repeats, tell)
    text = [TEXT.format(robots), _table(found)]
    text += [f"Left out: {reason}" for reason in found.missing.values()]
    what = "MCAP over CSV, in the engine"
    targets = [Target(what, _ratio(found, HERE), 0.2, at_least=False)]
    return Section("recording", TITLE, text, targets)


def _ratio(found: Table, name: str) -> Spread:
    """The ratio of the two outputs in each run."""
    return Spread(tuple(run["mcap"] / run["csv"] for run in found.runs[name] if run))


def _table(found: Table) -> str:
    rows = [
        [
            name,
            found.spread(name, "csv").show(".1f"),
            found.spread(name, "mcap").show(".1f"),
            _ratio(found, name).show(),
        ]
        for name in (HERE, APART)
    ]
    return table(["us of a robot and tick", "CSV", "MCAP", "MCAP over CSV"], rows)

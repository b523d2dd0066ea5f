"""Cost of recording a run, in CSV files and in one MCAP file."""

from __future__ import annotations

from benchmarks.contest import Contender, Spread, Table, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Recording a run"
HERE, APART, SHARED, EACH, ALONE = "engine", "processes", "shared", "ten", "alone"

TEXT = """Processor time of two outputs in one run, which record command, state and
sensors of {} kinematic Woodbots: CSV writes a file for each robot, MCAP one for all. In
the engine, that is what an output itself does. In a shared process, as the recorder of
every run has it, it is what the recorder adds to the process of the CSV output. In
processes of their own it is what their threads do: the host of the robots sends three
messages a tick, each with the values of all robots. Beside it is an output that only
reads them as values, and what they would cost as three messages for each robot: a bare
Zenoh subscriber that reads key, payload and stamp of each."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    robots, ticks = (5, 6) if quick else (1000, 60)
    few, many = (2, 6) if quick else (10, 400)
    contenders = [
        Contender(HERE, "recording", (robots, ticks, "here")),
        Contender(APART, "recording", (robots, ticks, "apart")),
        Contender(SHARED, "recording", (robots, ticks, "shared")),
        Contender(ALONE, "recording", (robots, ticks, "alone")),
        Contender(EACH, "recording", (few, many, "each")),
    ]
    found = interleave(contenders, repeats, tell)
    text = [TEXT.format(robots), _table(found), _received(found)]
    text += [f"Left out: {reason}" for reason in found.missing.values()]
    what = "MCAP over CSV, {}"
    engine, both, own = (_ratio(found, way) for way in (HERE, SHARED, APART))
    targets = [
        Target(what.format("in the engine"), engine, 0.2, at_least=False),
        Target(what.format("in a shared process"), both, 0.2, at_least=False),
        Target(what.format("in processes of their own"), own, 0.2, at_least=False),
        Target(
            "ticks of a recorder over those of an output that only reads",
            _ratio(found, ALONE, "reading", "mcap"),
            0.9,
        ),
        Target(
            f"recording {few} robots over a tick of theirs",
            _ratio(found, EACH, "mcap", "tick"),
            0.1,
            at_least=False,
        ),
    ]
    return Section("recording", TITLE, text, targets)


def _ratio(found: Table, name: str, of: str = "mcap", over: str = "csv") -> Spread:
    """Return the ratio of two numbers in each run."""
    return Spread(tuple(run[of] / run[over] for run in found.runs[name] if run))


def _received(found: Table) -> str:
    """Return what receiving costs, in a process of its own."""
    words = {
        "reading": "reads values",
        "floor": "bare Zenoh subscriber, message by message",
    }
    rows = [[words[n], found.spread(APART, n).show(".1f")] for n in words]
    return table(["in a process of its own", "us of a robot and tick"], rows)


def _table(found: Table) -> str:
    rows = [
        [
            name,
            found.spread(name, "csv").show(".1f"),
            found.spread(name, "mcap").show(".1f"),
            _ratio(found, name).show(),
        ]
        for name in (HERE, SHARED, APART)
    ]
    return table(["us of a robot and tick", "CSV", "MCAP", "MCAP over CSV"], rows)

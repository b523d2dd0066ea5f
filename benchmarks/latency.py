"""How old a robot's state is when an agent in another process reads it."""

from __future__ import annotations

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Latency from one agent to another"
OURS, RAW = "rems_net", "raw zenoh"

TEXT = """A robot writes its state, and an agent in another process reads that state
within the same tick. The latency covers checking, encoding, two hops, decoding,
filling the In and being called, at 200 ticks per second of real time."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    ticks = 50 if quick else 1000
    contenders = [
        Contender(OURS, "latency", ("rems", ticks)),
        Contender(RAW, "latency", ("raw", ticks)),
    ]
    found = interleave(contenders, repeats, tell)
    rows = [
        [
            name,
            found.spread(name, "median").show(".0f"),
            found.spread(name, "p99").show(".0f"),
        ]
        for name in (OURS, RAW)
    ]
    text = [TEXT, table(["one way", "median [us]", "p99 [us]"], rows)]
    ratio = found.ratio(OURS, RAW, "median")
    targets = [Target("median latency, rems_net over raw zenoh", ratio, 1.25, False)]
    return Section("latency", TITLE, text, targets)

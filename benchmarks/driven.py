"""Robots that are driven: how even their device thread's rhythm is at the device."""

from __future__ import annotations

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "A device thread at 50 Hz"
OURS, BARE = "rems_net", "bare loop"

TEXT = """The driver of a Create 2 and a bare loop of pyserial, each at 50 Hz on a
pseudo-terminal, with an emulated Create 2 at the other end. Jitter is the difference
from 20 ms of the time between two commands, as they arrive at the device. The host's
thread works for 0.2 ms of every 50, and the device thread waits for it."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    exchanges = 50 if quick else 1_000
    contenders = [
        Contender(OURS, "driving", ("rems", exchanges)),
        Contender(BARE, "driving", ("bare", exchanges)),
    ]
    found = interleave(contenders, repeats, tell)
    rows = [
        [name, *(found.spread(name, w).show(".0f") for w in ("p50", "p99"))]
        for name in (OURS, BARE)
    ]
    targets = [
        Target(
            "p99 jitter, rems_net over the bare loop",
            found.ratio(OURS, BARE, "p99"),
            1.5,
            False,
        )
    ]
    head = ["", "p50 [us]", "p99 [us]"]
    return Section("driven", TITLE, [TEXT, table(head, rows)], targets)

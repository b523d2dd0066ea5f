"""Real time at 1 kHz: how late ticks are, whether any is lost, whether time drifts."""

from __future__ import annotations

from benchmarks.contest import Contender, Spread, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Real time at 1 kHz"
OURS, BARE, WAITING = "rems_net", "bare loop", "bare loop that waits"

TEXT = """Ten seconds at `pace=1`, `dt="1 ms"`, with one robot in a process of its own
that answers every tick. The bare loop puts a tick with plain zenoh-python, and does
not wait for the answer; the other one does. Lateness is of the moment at which a tick
is put. Drift is the median lateness of the last second minus that of the first."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    ticks = 300 if quick else 10_000
    contenders = [
        Contender(OURS, "paced", ("rems", ticks)),
        Contender(BARE, "paced", ("bare", ticks)),
        Contender(WAITING, "paced", ("waiting", ticks)),
    ]
    found = interleave(contenders, repeats, tell)
    rows = [
        [
            name,
            *(
                found.spread(name, w).show(".0f")
                for w in ("p50", "p99", "lost", "drift")
            ),
        ]
        for name in (OURS, BARE, WAITING)
    ]
    head = ["", "p50 [us]", "p99 [us]", "lost", "drift [us in 10 s]"]
    drift = Spread(tuple(abs(r["drift"]) for r in found.runs[OURS] if r))
    targets = [
        Target(
            f"p99 lateness, rems_net over {other}",
            found.ratio(OURS, other, "p99"),
            1.5,
            False,
        )
        for other in (BARE, WAITING)
    ]
    targets += [
        Target("ticks lost", found.spread(OURS, "lost"), 0, False, ".0f"),
        Target("drift [us in 10 s], either way", drift, 100, False, ".0f"),
    ]
    return Section("realtime", TITLE, [TEXT, table(head, rows)], targets)

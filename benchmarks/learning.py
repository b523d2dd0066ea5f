"""Cost of learning from a robot: a fit of its parameters, an update of a network."""

from __future__ import annotations

from benchmarks.contest import Contender, Spread, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "Learning from a robot"
OURS, BARE = "rems_net", "a bare loop in numpy"

TEXT = """An update of a [residual](../identification.md#what-the-parameters-leave-over)
of 68 weights by an unscented Kalman filter, and a fit of two parameters to a drive of
10 s. The bare loops are for a Woodbot only: the filter of textbooks, whose last digits
depend on the processor, and eight steps of a fit, without intervals or jolts."""
LABELS = {"update": "update of 68 weights", "fit": "fit of 10 s"}


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    contenders = [
        Contender(OURS, "learning", ("rems_net",)),
        Contender(BARE, "learning", ("bare",)),
    ]
    found = interleave(contenders, repeats, tell)
    rows = []
    for what, label in LABELS.items():
        each = [found.spread(name, what) for name in (OURS, BARE)]
        cells = [
            f"{one.median / 1000:.3g} ({min(one.values) / 1000:.3g} to "
            f"{max(one.values) / 1000:.3g})"
            for one in each
        ]
        rows.append([label, *cells, found.ratio(OURS, BARE, what).show()])
    head = ["", f"{OURS} [ms]", f"{BARE} [ms]", "ratio"]
    took = Spread(tuple(us / 1000 for us in found.spread(OURS, "update").values))
    targets = [Target("update of 68 weights [ms]", took, 0.5, at_least=False)]
    return Section("learning", TITLE, [TEXT, table(head, rows)], targets)

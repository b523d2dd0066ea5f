"""The page that shows a fabric: what its server costs, by the number of browsers."""

from __future__ import annotations

from benchmarks import contest
from benchmarks.contest import Contender, Table, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "The page of a fabric"
WATCH = "one `rems watch`"
FROZEN = "and one that is frozen"

TEXT = """Kinematic Woodbots at 50 Hz of real time, in one host. Browsers without
pictures, in a process of their own, take 30 frames a second. *CPU* and *memory* are
those of the server's process. *A plain server* of the library `websockets` sends frames
of the same size to as many clients, without a fabric. More than 16 robots of a host
are a crowd, whose states come in one message. *Behind* is how many frames one browser
got less than another. A frozen browser takes no frame from the begin of the measurement
on, and *grown* is what the server's memory gains from then on."""

BESIDE = """The same robots, as fast as possible, while others look at all their states:
ticks per second of the run."""

STOP = """From a click on STOP in one browser to STOP on the fabric, while all others
look:"""

HEAD = [
    "",
    "CPU [% of a core]",
    "memory [MB]",
    "grown [MB]",
    "frames per second",
    "behind",
    "bytes of a frame",
]
COLUMNS = (
    ("cpu", ".1f"),
    ("memory", ".0f"),
    ("grown", ".2f"),
    ("frames", ".1f"),
    ("behind", ".0f"),
    ("bytes", ".0f"),
)


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    seconds, counts = (1, (1, 3)) if quick else (8, (1, 10, 30))
    robots, crowd = (3, 6) if quick else (30, 1000)
    # so long that the system's own buffers of a frozen browser are full, too
    long = 2 if quick else 20
    first = contest.run(Contender("a frame's size", "page", (robots, 1, 1)))
    frame = round(first["bytes"])
    contenders = []
    for count in counts:
        look, plain = f"{robots} robots, {_many(count)}", f"plain, {_many(count)}"
        contenders += [
            Contender(look, "page", (robots, count, seconds)),
            Contender(plain, "page", (robots, count, seconds, frame)),
        ]
    one, few = f"{crowd} robots, {_many(1)}", f"{crowd} robots, {_many(3)}"
    contenders += [
        Contender(one, "page", (crowd, 1, seconds)),
        Contender(few, "page", (crowd, 3, long)),
        Contender(f"{few} {FROZEN}", "page", (crowd, 3, long, "frozen")),
    ]
    found = interleave(contenders, repeats, tell)
    pages = f"a page, {_many(counts[-1])}"
    beside = [
        Contender(WATCH, "beside", (robots, seconds, 0)),
        Contender(pages, "beside", (robots, seconds, counts[-1])),
    ]
    ticks = interleave(beside, repeats, tell)
    stopping = Contender("STOP", "stop", (robots, counts[-1], 3 if quick else 200))
    stops = interleave([stopping], repeats, tell)
    text = [TEXT, table(HEAD, _rows(found)), BESIDE]
    rates = [
        [name, ticks.spread(name).show(".0f")] for name, runs in ticks.runs.items()
    ]
    text.append(table(["beside", "ticks per second"], rates))
    if not stops.missing:
        times = [stops.spread("STOP", one).show(".1f") for one in ("stop", "stop p99")]
        text += [STOP, table(["median [ms]", "p99 [ms]"], [times])]
    missing = {**found.missing, **ticks.missing, **stops.missing}
    text += [f"Left out: {reason}" for reason in missing.values()]
    most = f"{robots} robots, {_many(counts[-1])}"
    aims = [
        (f"{robots} robots, {_many(counts[0])}", "cpu", 5),
        (most, "cpu", 8),
        (most, "memory", 100),
        (one, "cpu", 3),
        (f"{few} {FROZEN}", "grown", 2),
        (f"{few} {FROZEN}", "behind", 1),
    ]
    targets = [
        Target(f"{name}: {what}", found.spread(name, what), bound, at_least=False)
        for name, what, bound in aims
        if found.runs.get(name)
    ]
    if not ticks.missing:
        what = "ticks per second beside the page, over those beside `rems watch`"
        targets.append(Target(what, ticks.ratio(pages, WATCH), 0.9))
    if not stops.missing:
        what = f"p99 of STOP, {_many(counts[-1])} [ms]"
        targets.append(Target(what, stops.spread("STOP", "stop p99"), 10, False))
    return Section("dashboard", TITLE, text, targets)


def _many(count: int) -> str:
    return f"{count} browser" if count == 1 else f"{count} browsers"


def _rows(found: Table) -> list[list[str]]:
    return [
        [name, *(found.spread(name, what).show(form) for what, form in COLUMNS)]
        for name, runs in found.runs.items()
        if runs
    ]

"""The page that shows a fabric: what its server costs, by the number of browsers."""

from __future__ import annotations

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "The page of a fabric"
#: bytes of a frame of 30 Woodbots
FRAME = 8500

TEXT = """Kinematic Woodbots at 50 Hz of real time, in one host. Browsers without
pictures, in a process of their own, take 30 frames a second. *CPU* and *memory* are
those of the server's process. *A plain server* of the library `websockets` sends frames
of the same size to as many clients, without a fabric. More than 100 robots of a host
are a crowd, whose states come in one message."""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    seconds, counts = (1, (1, 3)) if quick else (8, (1, 10, 30))
    robots, crowd = (3, 0) if quick else (30, 1000)
    contenders = []
    for count in counts:
        contenders += [
            Contender(
                f"{robots} robots, {count} browsers", "page", (robots, count, seconds)
            ),
            Contender(
                f"plain server, {count} browsers",
                "page",
                (robots, count, seconds, FRAME),
            ),
        ]
    if crowd:
        contenders.append(
            Contender(f"{crowd} robots, 1 browsers", "page", (crowd, 1, seconds))
        )
    found = interleave(contenders, repeats, tell)
    columns = (("cpu", ".1f"), ("memory", ".0f"), ("frames", ".1f"), ("bytes", ".0f"))
    rows = [
        [name, *(found.spread(name, what).show(form) for what, form in columns)]
        for name, runs in found.runs.items()
        if runs
    ]
    head = [
        "",
        "CPU [% of a core]",
        "memory [MB]",
        "frames per second",
        "bytes of a frame",
    ]
    text = [TEXT, table(head, rows)]
    text += [f"Left out: {reason}" for reason in found.missing.values()]
    aims = [
        (f"{robots} robots, {counts[0]} browsers", "cpu", 5),
        (f"{robots} robots, {counts[-1]} browsers", "cpu", 8),
        (f"{robots} robots, {counts[-1]} browsers", "memory", 100),
        (f"{crowd} robots, 1 browsers", "cpu", 3),
    ]
    targets = [
        Target(f"{name}: {what}", found.spread(name, what), bound, at_least=False)
        for name, what, bound in aims
        if found.runs.get(name)
    ]
    return Section("dashboard", TITLE, text, targets)

"""Robots that are driven: how even their device thread's rhythm is at the device."""

from __future__ import annotations

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "A device thread at 50 Hz"
OURS, BARE = "rems_net", "bare loop"

TEXT = """The driver of a Create 2 and a bare loop of pyserial, each at 50 Hz on a
pseudo-terminal. At the other end is an emulated Create 2 in a process of its own. The
bare loop writes a command, throws away the input, and sleeps until start + n 20 ms. The
driver chooses between command and safe command, writes, and finds the frames of 39
packets. It checks them and the command that the robot reports. It adds up its path, and
hands the readings to a host's thread that takes them at 20 Hz. Jitter is the difference
from 20 ms of the time between two commands, as they arrive at the device.

Its known causes, by the processor's time: the emulated robot is busy for 0.45 ms of
every 15, and receives nothing then, in both rows. After a sleep of 20 ms caches are
cold: the write, 0.01 ms in a loop, takes 0.08 ms; with the choice before it 0.16, and
0.24 once in a hundred. And Python runs one thread at a time. A host's thread works for
0.2 ms of every 50, and the device thread waits for it. A thread that computes could
hold it up for 5 ms after each read and write, but the driver makes Python take turns
after 0.1 ms. No thread of Python can promise less, and no system that is not a
real-time one."""


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

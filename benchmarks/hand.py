"""A page in a real browser: how late a key is, and what it draws."""

from __future__ import annotations

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, Target, table

TITLE = "A page in a browser"
KEY, VIEWER, SEEN = "a key", "a viewer", "a page"

TEXT = """A kinematic Woodbot at 50 Hz of real time, the server of its page, and a
headless Chromium, each in a process of its own. DevTools press a key of the page. The
time until its command is on the fabric, and until the robot obeys it:"""
LOOKS = """Cost of the page's server for one viewer (such as Lichtblick) that looks
at the states of 30 robots:"""

DRAWN = """A Chromium without a graphics card, whose folder is new, shows a run of 30
robots at 50 Hz, and is sent 60 pictures a second. *Ready* is from the start of the
browser until all robots are there:"""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    presses, robots, seconds = (5, 3, 1) if quick else (100, 30, 8)
    contenders = [
        Contender(KEY, "hand", (presses,)),
        Contender(VIEWER, "hand", ("viewer", robots, seconds)),
        Contender(SEEN, "hand", ("seen", robots, seconds)),
    ]
    found = interleave(contenders, repeats, tell)
    text = []
    if found.runs[KEY]:
        rows = [
            [what, *(found.spread(KEY, one).show(".1f") for one in (it, f"{it} p99"))]
            for what, it in (("the command", "put"), ("the robot obeys", "obeyed"))
        ]
        text += [TEXT, table(["", "median [ms]", "p99 [ms]"], rows)]
    if found.runs[VIEWER]:
        shown = ((found.spread(VIEWER, one).show(".1f")) for one in ("cpu", "values"))
        text += [LOOKS, table(["CPU [% of a core]", "values per second"], [[*shown]])]
    targets = []
    if found.runs[SEEN]:
        goals = (("ready", 2, False), ("drawn", 50, True), ("ms", 20, False))
        words = "ready [s]", "pictures a second", "time of one [ms]"
        spreads = [found.spread(SEEN, name) for name, _, _ in goals]
        text += [DRAWN, table([*words], [[one.show(".1f") for one in spreads]])]
        targets = [
            Target(f"{robots} robots in a browser: {word}", one, bound, at_least=more)
            for word, one, (_, bound, more) in zip(words, spreads, goals, strict=True)
        ]
    text += [f"Left out: {reason}" for reason in found.missing.values()]
    return Section("hand", TITLE, text, targets)

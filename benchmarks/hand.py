"""Driving by a key in a browser: how late the command and the robot are."""

from __future__ import annotations

from benchmarks.contest import Contender, Tell, interleave
from benchmarks.report import Section, table

TITLE = "A key in a browser"
KEY, VIEWER = "a key", "a viewer"

TEXT = """A kinematic Woodbot at 50 Hz of real time, the server of its page, and a
headless Chromium, each in a process of its own. DevTools press a key of the page. The
time until its command is on the fabric, and until the robot obeys it:"""
LOOKS = """Cost of the page's server for one viewer (such as Lichtblick) that looks
at the states of 30 robots:"""


def measure(repeats: int, quick: bool, tell: Tell) -> Section:
    presses, robots, seconds = (5, 3, 1) if quick else (100, 30, 8)
    contenders = [
        Contender(KEY, "hand", (presses,)),
        Contender(VIEWER, "hand", ("viewer", robots, seconds)),
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
    text += [f"Left out: {reason}" for reason in found.missing.values()]
    return Section("hand", TITLE, text)
